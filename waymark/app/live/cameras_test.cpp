#include "waymark/app/live/cameras.hpp"

#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/golden_page.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::Not;

TEST(SystemStamps, KeepTimeDifferencesWhenTheClockIsSet) {
  Duration steady = seconds(100);
  Duration system = seconds(1'700'000'000);
  SystemStamps stamps({.steady = [&] { return steady; }, .system = [&] { return system; }});
  const SensorTime before = stamps.at(SensorTime(steady));
  EXPECT_EQ(before.time_since_epoch(), system);
  steady += seconds(1);
  system += seconds(1) + milliseconds(1);  // as slewed by 1 ms
  EXPECT_FALSE(stamps.take_jump());
  steady += seconds(1);
  system -= seconds(3600);
  const auto text = stamps.take_jump();
  ASSERT_TRUE(text);
  EXPECT_THAT(*text, ::testing::HasSubstr("back by 3601.000 s"));
  testing::expect_on_page("live", *text);
  EXPECT_FALSE(stamps.take_jump());
  EXPECT_EQ(stamps.now() - before, seconds(2));
}

using std::chrono::milliseconds;

using ::testing::HasSubstr;

/// Sends a text first, then an image every 10 ms.
class SteadyCamera final : public LiveCamera {
 public:
  Result<std::optional<RobotEvent>> next(Duration /*most*/) override {
    if (!std::exchange(text_sent_, true)) return std::optional<RobotEvent>(RobotText{"hello"});
    std::this_thread::sleep_for(milliseconds(10));
    return std::optional<RobotEvent>(Sample(
        CameraFrame{.stamp = SensorTime(steady_now() - milliseconds(5)), .image = Image(64, 48, 128)}));
  }
  [[nodiscard]] bool more() const override { return true; }
  [[nodiscard]] std::optional<SensorTime> now() const override { return std::nullopt; }
  [[nodiscard]] CameraCounts counts() const override { return {.dropped = 3}; }
  [[nodiscard]] std::string description() const override { return "steady"; }

 private:
  bool text_sent_ = false;
};

TEST(CameraWatch, DeliversImagesWithTimesSince1970UntilTheDurationIsOver) {
  SteadyCamera camera;
  const auto finder = make_tag_finder();
  std::string words;
  std::vector<SensorTime> stamps;
  CameraWatch watch{.lens = ImageLens::unknown(), .duration_s = 0.1};
  watch.on_message = [&](const std::string& text) { words += text; };
  watch.on_image = [&](CameraImage& seen) {
    EXPECT_GE(to_seconds(seen.age), 0.005);
    stamps.push_back(seen.frame.stamp);
    return Status();
  };
  const auto end = watch_camera(camera, *finder, watch);
  ASSERT_TRUE(end);
  EXPECT_EQ(words, "hello");
  EXPECT_EQ(end->images, stamps.size());
  EXPECT_GE(end->seconds, 0.1);
  EXPECT_EQ(end->counts.dropped, 3U);
  EXPECT_FALSE(end->stopped);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  EXPECT_LT(std::abs(to_seconds(now - stamps.back().time_since_epoch())), 1);
}

TEST(CameraWatch, RefusesACalibrationOfAnotherSize) {
  SteadyCamera camera;
  const auto finder = make_tag_finder();
  const CameraModel model =
      CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value();
  CameraWatch watch{.lens = ImageLens::of(model), .duration_s = 0.1};
  watch.on_image = [](CameraImage& /*seen*/) { return Status(); };
  EXPECT_FALSE(watch_camera(camera, *finder, watch));
}

TEST(CameraAddress, MayHaveTheNameOfARobotCamera) {
  EXPECT_EQ(parse_camera_address("v4l2:0,size=64x48", "cam")->name, "cam");
  const auto named = parse_camera_address("front=gstreamer:videotestsrc pattern=black", "cam");
  ASSERT_TRUE(named);
  EXPECT_EQ(named->name, "front");
  EXPECT_EQ(named->address, "gstreamer:videotestsrc pattern=black");
  for (const char* wrong : {"", "/dev/video0", "=v4l2:0", "front=/dev/video0"})
    EXPECT_FALSE(parse_camera_address(wrong, "cam")) << wrong;
}

TEST(CamerasText, EscapesControlCharactersInDriverNames) {
  const CameraDevice device{.path = "/dev/video7",
                            .card = "Cam\x1b[2Jera",
                            .driver = "uvcvideo",
                            .bus = "usb\n1",
                            .modes = {{.format = "H264", .readable = false, .width = 640, .height = 480}},
                            .controls = {{.name = "gain", .value = 3, .max = 8},
                                         {.name = "hue",
                                          .value = 1,
                                          .max = 2,
                                          .words = {"a",
                                                    "\x07"
                                                    "b"}}}};
  const std::string text = to_text(CamerasReport{{device}}, true);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_EQ(text.find('\x07'), std::string::npos);
  testing::expect_on_page("live", text);
  EXPECT_THAT(text, HasSubstr("hue"));
  EXPECT_THAT(to_text(CamerasReport{{device}}, false), Not(HasSubstr("hue")))
      << "only the controls that matter for measurements";
  const json value = json(to_json(fields(CamerasReport{{device}})));
  EXPECT_EQ(value["cameras"][0]["controls"].size(), 2U);
  EXPECT_FALSE(value["cameras"][0].contains("problem"));
}

TEST(CamerasText, AValueOutsideItsMenuHasNoName) {
  CameraDevice device{.path = "/dev/video0",
                      .controls = {{.name = "mode", .max = 9, .words = {"off", "on"}}}};
  for (const double value : {-1.0, 2.0, 1e300}) {
    device.controls[0].value = value;
    const std::string text = to_text(CamerasReport{{device}}, true);
    EXPECT_THAT(text, Not(HasSubstr("(off)")));
    EXPECT_THAT(text, Not(HasSubstr("(on)")));
  }
  device.controls[0].value = 1;
  EXPECT_THAT(to_text(CamerasReport{{device}}, true), HasSubstr("(on)"));
}

}  // namespace
}  // namespace waymark
