#include "waymark/cameras/v4l2/v4l2_camera.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <thread>
#include <variant>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/fake_camera.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/cameras/v4l2/device_list.hpp"
#include "waymark/codecs/image_codec.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;

using ::testing::ElementsAre;

using ::testing::HasSubstr;

using waymark::testing::FakeCamera;

constexpr int kWidth = 64;

constexpr int kHeight = 48;

/// Uniform grey images with levels `first`, `first` + 1, …, so that any pixel identifies the image.
std::vector<std::uint8_t> levels(int count, int first = 50) {
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < count; ++i)
    bytes.insert(bytes.end(), std::size_t{kWidth} * kHeight, static_cast<std::uint8_t>(first + i));
  return bytes;
}

std::unique_ptr<V4l2Camera> open(V4l2Options options = {}) {
  auto camera = V4l2Camera::open(options);
  EXPECT_TRUE(camera) << (camera ? "" : to_string(camera.error()));
  return camera ? std::move(*camera) : nullptr;
}

/// Returns the next image and appends the messages before it to `reports`.
std::optional<CameraFrame> next_image(V4l2Camera& camera, std::vector<std::string>* reports = nullptr,
                                      Duration timeout = milliseconds(2000)) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (std::chrono::steady_clock::now() < deadline) {
    auto event = camera.next(milliseconds(200));
    if (!event) return std::nullopt;
    if (!*event) continue;
    if (auto* sample = std::get_if<Sample>(&**event)) return std::get<CameraFrame>(std::move(*sample));
    if (reports != nullptr) reports->push_back(std::get<RobotText>(**event).text);
  }
  return std::nullopt;
}

std::string all_reports(V4l2Camera& camera, int images) {
  std::vector<std::string> reports;
  for (int i = 0; i < images; ++i) (void)next_image(camera, &reports);
  return std::accumulate(reports.begin(), reports.end(), std::string(),
                         [](const std::string& all, const std::string& one) { return all + one + "\n"; });
}

TEST(V4l2CameraThreads, DeliversImagesInOrderWithStampsAtTheMiddleOfTheExposure) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 50, levels(200));
  auto camera = open();
  ASSERT_NE(camera, nullptr);
  EXPECT_THAT(camera->description(), HasSubstr("Fake camera, 64 x 48 px, GREY, 50 Hz"));
  std::vector<std::string> reports;
  const auto first = next_image(*camera, &reports);
  ASSERT_TRUE(first);
  EXPECT_THAT(reports, ElementsAre(HasSubstr("white_balance_k, exposure_ms")));
  testing::expect_on_page("cameras", reports.front());
  SensorTime last = first->stamp;
  for (int i = 1; i < 20; ++i) {
    const auto photo = next_image(*camera);
    ASSERT_TRUE(photo);
    const int steps = photo->image.view().at(3, 5) - first->image.view().at(3, 5);
    // Images are 20 ms apart by the driver's stamps, not by their arrival.
    EXPECT_NEAR(to_seconds(photo->stamp - first->stamp), 0.02 * steps, 2e-5);
    EXPECT_GT(photo->stamp, last);
    last = photo->stamp;
  }
  // The exposure starts 20 ms before the arrival and lasts 10 ms, so its middle is 15 ms before the arrival.
  const auto photo = next_image(*camera);
  const Duration age = std::chrono::steady_clock::now().time_since_epoch() - photo->stamp.time_since_epoch();
  EXPECT_GT(to_seconds(age), 0.0149);
  EXPECT_LT(to_seconds(age), 0.1);
}

TEST(V4l2CameraThreads, ReportsARateThatIsNotReached) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 50, levels(200));
  V4l2Options options{.rate_hz = 120};
  auto camera = open(options);
  ASSERT_NE(camera, nullptr);
  EXPECT_THAT(all_reports(*camera, 1), ::testing::AllOf(HasSubstr("120 Hz"), HasSubstr("50 Hz")));
  camera.reset();
  options.rate_hz = 50;
  camera = open(options);
  ASSERT_NE(camera, nullptr);
  EXPECT_THAT(all_reports(*camera, 1), ::testing::Not(HasSubstr(" Hz")));
}

TEST(V4l2CameraThreads, ASlowReaderGetsTheNewestImage) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  auto camera = open();
  ASSERT_NE(camera, nullptr);
  ASSERT_TRUE(next_image(*camera));
  std::this_thread::sleep_for(milliseconds(300));
  const auto image = next_image(*camera);
  ASSERT_TRUE(image);
  const Duration age = std::chrono::steady_clock::now().time_since_epoch() - image->stamp.time_since_epoch();
  EXPECT_LT(to_seconds(age), 0.06);  // a queue of six images would lag by 200 ms
  EXPECT_GE(camera->counts().dropped, 20U);
  EXPECT_EQ(camera->counts().lost, 0U);
}

TEST(V4l2CameraThreads, EveryFormatGivesTheSameGrey) {
  Image image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) image.row(y)[x] = static_cast<std::uint8_t>(40 + 2 * x + y);
  std::vector<std::uint8_t> yuyv, uyvy, nv12;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      yuyv.insert(yuyv.end(), {image.row(y)[x], 7});
      uyvy.insert(uyvy.end(), {9, image.row(y)[x]});
      nv12.push_back(image.row(y)[x]);
    }
  }
  nv12.resize(nv12.size() * 3 / 2, 128);
  const auto jpeg = encode_jpeg(image, 100);
  ASSERT_TRUE(jpeg);
  FakeCamera fake;
  fake.add_mode("YUYV", kWidth, kHeight, 100, yuyv);
  fake.add_mode("UYVY", kWidth, kHeight, 100, uyvy);
  fake.add_mode("NV12", kWidth, kHeight, 100, nv12);
  fake.add_mode("MJPG", kWidth, kHeight, 100, *jpeg);
  for (const PixelFormat format :
       {PixelFormat::Yuyv, PixelFormat::Uyvy, PixelFormat::Nv12, PixelFormat::Mjpg}) {
    auto camera = open({.format = format});
    ASSERT_NE(camera, nullptr) << to_string(format);
    const auto seen = next_image(*camera);
    ASSERT_TRUE(seen) << to_string(format);
    int worst = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        worst = std::max(worst, std::abs(seen->image.row(y)[x] - image.row(y)[x]));
    EXPECT_LE(worst, format == PixelFormat::Mjpg ? 2 : 0) << to_string(format);
  }
}

TEST(V4l2CameraThreads, WaitsForAnUnpluggedCamera) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  auto camera = open();
  ASSERT_NE(camera, nullptr);
  ASSERT_TRUE(next_image(*camera));
  fake.unplug();
  std::vector<std::string> reports;
  EXPECT_FALSE(next_image(*camera, &reports, milliseconds(400)));
  EXPECT_THAT(reports, ElementsAre(HasSubstr("unplugged")));
  testing::expect_on_page("cameras", reports.front());
  fake.plug_in();
  reports.clear();
  EXPECT_TRUE(next_image(*camera, &reports));
  EXPECT_THAT(reports, ElementsAre(HasSubstr("/dev/video0")));
  testing::expect_on_page("cameras", reports.front());
}

TEST(V4l2CameraThreads, FailsIfItStaysUnplugged) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  auto camera = open({.reconnect_within = milliseconds(100)});
  ASSERT_NE(camera, nullptr);
  ASSERT_TRUE(next_image(*camera));
  fake.unplug();
  Result<std::optional<RobotEvent>> event = std::optional<RobotEvent>();
  for (int i = 0; i < 20 && event; ++i) event = camera->next(milliseconds(100));
  ASSERT_FALSE(event);
  EXPECT_EQ(event.error().code, ErrorCode::NotFound);
}

TEST(V4l2CameraThreads, SkipsDamagedImages) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  for (const char* fault : {"short:3", "flag:3"}) {
    FakeCamera::set_faults(fault);
    auto camera = open();
    ASSERT_NE(camera, nullptr);
    EXPECT_THAT(all_reports(*camera, 10), HasSubstr("damaged image")) << fault;
    EXPECT_GE(camera->counts().damaged, 3U) << fault;
  }
}

TEST(V4l2CameraThreads, ReportsBlackAndFrozenImages) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  FakeCamera::set_faults("black:5");
  EXPECT_THAT(all_reports(*open(), 10), HasSubstr("black"));
  FakeCamera::set_faults("freeze:5");
  EXPECT_THAT(all_reports(*open(), 125), HasSubstr("identical"));
}

TEST(V4l2CameraThreads, StampsAtArrivalIfDriverStampsAreInvalid) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  FakeCamera::set_faults("back:5");
  auto camera = open();
  ASSERT_NE(camera, nullptr);
  EXPECT_THAT(all_reports(*camera, 10), HasSubstr("two seconds"));
  SensorTime last{};
  for (int i = 0; i < 10; ++i) {
    const auto image = next_image(*camera);
    ASSERT_TRUE(image);
    EXPECT_GT(image->stamp, last);
    last = image->stamp;
  }
  const Duration age = std::chrono::steady_clock::now().time_since_epoch() - last.time_since_epoch();
  EXPECT_LT(to_seconds(age), 0.2);
}

TEST(V4l2CameraThreads, ReportsASilentCamera) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  FakeCamera::set_faults("stall:5");
  auto camera = open();
  ASSERT_NE(camera, nullptr);
  std::vector<std::string> reports;
  while (next_image(*camera, &reports, milliseconds(2500))) {
  }
  ASSERT_FALSE(reports.empty());
  testing::expect_on_page("cameras", reports.back());
}

TEST(V4l2Camera, ErrorsHaveHints) {
  FakeCamera fake;
  const auto missing = V4l2Camera::open({});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
  EXPECT_THAT(missing.error().hint, HasSubstr("waymark cameras"));
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(10));
  FakeCamera::set_faults("denied");
  const auto denied = V4l2Camera::open({});
  ASSERT_FALSE(denied);
  EXPECT_THAT(denied.error().hint, HasSubstr("usermod -aG "));
  FakeCamera::set_faults("busy");
  const auto busy = V4l2Camera::open({});
  ASSERT_FALSE(busy);
  EXPECT_EQ(busy.error().code, ErrorCode::Unreadable);
  FakeCamera::set_faults("");
  const auto size = V4l2Camera::open({.width = 100, .height = 100});
  ASSERT_FALSE(size);
  EXPECT_THAT(to_string(size.error()), HasSubstr("100 x 100 px"));
  EXPECT_THAT(to_string(size.error()), HasSubstr("GREY 64x48"));
  for (const Error& error : {missing.error(), busy.error(), size.error()})
    testing::expect_on_page("cameras", error);
  EXPECT_FALSE(V4l2Camera::open({.device = "/dev/null"}));
  EXPECT_FALSE(V4l2Camera::open({.device = "/etc/passwd"}));
}

TEST(V4l2CameraThreads, SetsAndLocksControlsByName) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  auto camera = open({.controls = {{"exposure_ms", 5.0}, {"gain", 42}}, .lock = true});
  ASSERT_NE(camera, nullptr);
  std::map<std::string, CameraControl> by_name;
  for (const CameraControl& control : camera->controls()) by_name[control.name] = control;
  for (const char* name : {"exposure_ms", "gain", "white_balance_k"})
    EXPECT_FALSE(by_name.at(name).automatic) << name;
  EXPECT_NEAR(by_name.at("exposure_ms").value, 5.0, 1e-9);
  EXPECT_EQ(by_name.at("gain").value, 42);
  EXPECT_THAT(by_name.at("power_line_frequency").words, ElementsAre("Disabled", "50 Hz", "60 Hz"));
  EXPECT_EQ(camera->set_control("gain", 1000).error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(camera->set_control("gian", 1).error().hint, HasSubstr("gain"));
  EXPECT_TRUE(camera->set_control("brightness", -3));
}

}  // namespace
}  // namespace waymark
