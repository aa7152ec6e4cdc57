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

/// Grey pictures, each of one level: `first`, `first` + 1, … Their number can be read from any pixel.
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

/// The next picture; words on the way are kept.
std::optional<CameraFrame> next_picture(V4l2Camera& camera, std::vector<std::string>* words = nullptr,
                                        Duration most = milliseconds(2000)) {
  const auto deadline = std::chrono::steady_clock::now() + most;
  while (std::chrono::steady_clock::now() < deadline) {
    auto event = camera.next(milliseconds(200));
    if (!event) return std::nullopt;
    if (!*event) continue;
    if (auto* sample = std::get_if<Sample>(&**event)) return std::get<CameraFrame>(std::move(*sample));
    if (words != nullptr) words->push_back(std::get<RobotText>(**event).text);
  }
  return std::nullopt;
}

std::string all_words(V4l2Camera& camera, int pictures) {
  std::vector<std::string> words;
  for (int i = 0; i < pictures; ++i) (void)next_picture(camera, &words);
  return std::accumulate(words.begin(), words.end(), std::string(),
                         [](const std::string& all, const std::string& one) { return all + one + "\n"; });
}

TEST(V4l2CameraThreads, DeliversEveryPictureInOrderWithStampsInTheMiddleOfTheExposure) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 50, levels(200));
  auto camera = open();
  ASSERT_NE(camera, nullptr);
  EXPECT_THAT(camera->description(), HasSubstr("Fake camera, 64 x 48 px, GREY, 50 Hz"));
  std::vector<std::string> words;
  const auto first = next_picture(*camera, &words);
  ASSERT_TRUE(first);
  EXPECT_THAT(words, ElementsAre(HasSubstr("white_balance_k, exposure_ms by itself")));
  SensorTime last = first->stamp;
  for (int i = 1; i < 20; ++i) {
    const auto picture = next_picture(*camera);
    ASSERT_TRUE(picture);
    const int steps = picture->image.view().at(3, 5) - first->image.view().at(3, 5);
    // 20 ms from picture to picture by the driver's stamps, not by when they arrive.
    EXPECT_NEAR(to_seconds(picture->stamp - first->stamp), 0.02 * steps, 2e-5);
    EXPECT_GT(picture->stamp, last);
    last = picture->stamp;
  }
  // 20 ms from the start of the exposure to the arrival, exposed for 10 ms: 15 ms ago in the middle.
  const auto picture = next_picture(*camera);
  const Duration age =
      std::chrono::steady_clock::now().time_since_epoch() - picture->stamp.time_since_epoch();
  EXPECT_GT(to_seconds(age), 0.0149);
  EXPECT_LT(to_seconds(age), 0.1);
}

TEST(V4l2CameraThreads, ARateThatIsNotReachedIsSaid) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 50, levels(200));
  V4l2Options options{.rate_hz = 120};
  auto camera = open(options);
  ASSERT_NE(camera, nullptr);
  EXPECT_THAT(all_words(*camera, 1), HasSubstr("asked for 120 Hz, the camera delivers 50 Hz"));
  camera.reset();
  options.rate_hz = 50;
  camera = open(options);
  ASSERT_NE(camera, nullptr);
  EXPECT_THAT(all_words(*camera, 1), ::testing::Not(HasSubstr("asked for")));
}

TEST(V4l2CameraThreads, ASlowTakerGetsTheNewestPicture) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  auto camera = open();
  ASSERT_NE(camera, nullptr);
  ASSERT_TRUE(next_picture(*camera));
  std::this_thread::sleep_for(milliseconds(300));
  const auto picture = next_picture(*camera);
  ASSERT_TRUE(picture);
  const Duration age =
      std::chrono::steady_clock::now().time_since_epoch() - picture->stamp.time_since_epoch();
  EXPECT_LT(to_seconds(age), 0.06);  // a queue of six would be 200 ms behind
  EXPECT_GE(camera->counts().dropped, 20U);
  EXPECT_EQ(camera->counts().lost, 0U);
}

TEST(V4l2CameraThreads, EveryFormatGivesTheSameGrey) {
  Image picture(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) picture.row(y)[x] = static_cast<std::uint8_t>(40 + 2 * x + y);
  std::vector<std::uint8_t> yuyv, uyvy, nv12;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      yuyv.insert(yuyv.end(), {picture.row(y)[x], 7});
      uyvy.insert(uyvy.end(), {9, picture.row(y)[x]});
      nv12.push_back(picture.row(y)[x]);
    }
  }
  nv12.resize(nv12.size() * 3 / 2, 128);
  const auto jpeg = encode_jpeg(picture, 100);
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
    const auto seen = next_picture(*camera);
    ASSERT_TRUE(seen) << to_string(format);
    int worst = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        worst = std::max(worst, std::abs(seen->image.row(y)[x] - picture.row(y)[x]));
    EXPECT_LE(worst, format == PixelFormat::Mjpg ? 2 : 0) << to_string(format);
  }
}

TEST(V4l2CameraThreads, WaitsForAnUnpluggedCamera) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  auto camera = open();
  ASSERT_NE(camera, nullptr);
  ASSERT_TRUE(next_picture(*camera));
  fake.unplug();
  std::vector<std::string> words;
  EXPECT_FALSE(next_picture(*camera, &words, milliseconds(400)));
  EXPECT_THAT(words, ElementsAre(HasSubstr("not plugged in any more")));
  fake.plug_in();
  words.clear();
  EXPECT_TRUE(next_picture(*camera, &words));
  EXPECT_THAT(words, ElementsAre(HasSubstr("there again")));
}

TEST(V4l2CameraThreads, FailsWhenItStaysUnplugged) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  auto camera = open({.reconnect_within = milliseconds(100)});
  ASSERT_NE(camera, nullptr);
  ASSERT_TRUE(next_picture(*camera));
  fake.unplug();
  Result<std::optional<RobotEvent>> event = std::optional<RobotEvent>();
  for (int i = 0; i < 20 && event; ++i) event = camera->next(milliseconds(100));
  ASSERT_FALSE(event);
  EXPECT_EQ(event.error().code, ErrorCode::NotFound);
}

TEST(V4l2CameraThreads, LeavesDamagedPicturesOut) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  for (const char* fault : {"short:3", "flag:3"}) {
    FakeCamera::set_faults(fault);
    auto camera = open();
    ASSERT_NE(camera, nullptr);
    EXPECT_THAT(all_words(*camera, 10), HasSubstr("damaged picture")) << fault;
    EXPECT_GE(camera->counts().damaged, 3U) << fault;
  }
}

TEST(V4l2CameraThreads, SaysThatPicturesAreBlackOrFrozen) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  FakeCamera::set_faults("black:5");
  EXPECT_THAT(all_words(*open(), 10), HasSubstr("black"));
  FakeCamera::set_faults("freeze:5");
  EXPECT_THAT(all_words(*open(), 125), HasSubstr("exactly like the one before for a second"));
}

TEST(V4l2CameraThreads, StampsByArrivalWhatTheDriverStampsBadly) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  FakeCamera::set_faults("back:5");
  auto camera = open();
  ASSERT_NE(camera, nullptr);
  EXPECT_THAT(all_words(*camera, 10), HasSubstr("more than two seconds back"));
  SensorTime last{};
  for (int i = 0; i < 10; ++i) {
    const auto picture = next_picture(*camera);
    ASSERT_TRUE(picture);
    EXPECT_GT(picture->stamp, last);
    last = picture->stamp;
  }
  const Duration age = std::chrono::steady_clock::now().time_since_epoch() - last.time_since_epoch();
  EXPECT_LT(to_seconds(age), 0.2);
}

TEST(V4l2CameraThreads, SaysThatTheCameraIsSilent) {
  FakeCamera fake;
  fake.add_mode("GREY", kWidth, kHeight, 100, levels(200));
  FakeCamera::set_faults("stall:5");
  auto camera = open();
  ASSERT_NE(camera, nullptr);
  std::vector<std::string> words;
  while (next_picture(*camera, &words, milliseconds(2500))) {
  }
  ASSERT_FALSE(words.empty());
  EXPECT_THAT(words.back(), HasSubstr("no picture for two seconds"));
}

TEST(V4l2Camera, ErrorsSayWhatToDo) {
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
  EXPECT_THAT(busy.error().message, HasSubstr("another program uses the camera"));
  FakeCamera::set_faults("");
  const auto size = V4l2Camera::open({.width = 100, .height = 100});
  ASSERT_FALSE(size);
  EXPECT_THAT(to_string(size.error()), HasSubstr("no pictures of 100 x 100 px"));
  EXPECT_THAT(to_string(size.error()), HasSubstr("GREY 64x48"));
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
