#include "waymark/app/doctor/computer_checks.hpp"

#include <algorithm>
#include <chrono>
#include <fstream>

#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

constexpr const char* kCameraInfo =
    "image_width: 640\nimage_height: 480\ncamera_name: cam\n"
    "camera_matrix: {rows: 3, cols: 3, data: [500, 0, 320, 0, 500, 240, 0, 0, 1]}\n"
    "distortion_model: plumb_bob\n"
    "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n";

TEST(Doctor, ReportsTheProblemOfEachCamera) {
  const auto none = check_cameras({});
  ASSERT_EQ(none.size(), 1U);
  EXPECT_EQ(none[0].level, DoctorLevel::Warn);
  CameraDevice good{.path = "/dev/video0", .card = "Webcam", .modes = {{.format = "YUYV"}}};
  CameraDevice used = good;
  used.holder = "cheese (process 7)";
  CameraDevice denied{
      .path = "/dev/video2",
      .problem = Error{ErrorCode::Unreadable, "not allowed", {}, "sudo usermod -aG video $USER"}};
  CameraDevice strange{.path = "/dev/video4", .modes = {{.format = "H264", .readable = false}}};
  const auto lines = check_cameras({good, used, denied, strange});
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_EQ(lines[0].level, DoctorLevel::Ok);
  EXPECT_TRUE(lines[0].command.empty());
  EXPECT_EQ(lines[1].level, DoctorLevel::Warn);
  EXPECT_THAT(lines[1].message, HasSubstr("cheese"));
  EXPECT_EQ(lines[2].level, DoctorLevel::Fail);
  EXPECT_THAT(lines[2].command, HasSubstr("usermod"));
  EXPECT_EQ(lines[3].level, DoctorLevel::Fail);
}

TEST(Doctor, WarnsAboutABlackOrWhiteImage) {
  Image image(640, 480);
  for (int y = 0; y < image.height(); ++y) std::fill_n(image.row(y), image.width(), std::uint8_t{9});
  const std::string dark = flat_image_warning(image.view());
  testing::expect_on_page("doctor", dark);
  for (int y = 0; y < image.height(); ++y) std::fill_n(image.row(y), image.width(), std::uint8_t{252});
  const std::string bright = flat_image_warning(image.view());
  testing::expect_on_page("doctor", bright);
  EXPECT_NE(bright.substr(bright.rfind(':')), dark.substr(dark.rfind(':')));
  for (int y = 100; y < 200; ++y) std::fill_n(image.row(y), image.width() / 2, std::uint8_t{60});
  EXPECT_EQ(flat_image_warning(image.view()), "");
  EXPECT_EQ(flat_image_warning(ImageView{}), "");
}

TEST(Doctor, ChecksAgeAndVerdictsOfACalibration) {
  namespace fs = std::filesystem;
  const fs::path file = fs::temp_directory_path() / ("waymark-doctor-" + std::to_string(getpid()) + ".yaml");
  const auto write = [&](const std::string& values) {
    std::ofstream(file)
        << "format: waymark-calibration-1\nprovenance: {}\ncamera_info:\n  image_width: 640\n"
           "  image_height: 480\n  camera_name: cam\n  camera_matrix: {rows: 3, cols: 3, data: [500, "
           "0, 320, 0, 500, 240, 0, 0, 1]}\n  distortion_model: plumb_bob\n  "
           "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\nvalues:\n"
        << values;
  };
  const auto now = fs::file_time_type::clock::now();
  write("  fx_px: {value: 500, sigma: 0.1, verdict: known}\n");
  const DoctorLine fresh = check_calibration(file, now);
  EXPECT_EQ(fresh.level, DoctorLevel::Ok) << fresh.message;
  EXPECT_EQ(check_calibration(file, now + std::chrono::hours(24 * 365)).level, DoctorLevel::Warn);
  write("  fx_px: {value: 500, sigma: 90, verdict: unobservable, advice: tilt it}\n");
  const DoctorLine unobservable = check_calibration(file, now);
  EXPECT_EQ(unobservable.level, DoctorLevel::Warn);
  EXPECT_THAT(unobservable.message, HasSubstr("fx_px"));
  testing::expect_on_page("doctor", unobservable.message);
  std::ofstream(file) << kCameraInfo;
  testing::expect_on_page("doctor", check_calibration(file, now).message);
  std::ofstream(file) << "nothing: 1\n";
  EXPECT_EQ(check_calibration(file, now).level, DoctorLevel::Fail);
  fs::remove(file);
  EXPECT_EQ(check_calibration(file, now).level, DoctorLevel::Fail);
}

TEST(Doctor, ChecksDiskAndProcessor) {
  EXPECT_EQ(check_disk(".", 50'000'000'000).level, DoctorLevel::Ok);
  EXPECT_EQ(check_disk(".", 1'000'000'000).level, DoctorLevel::Warn);
  EXPECT_EQ(check_disk(".", 1'000'000).level, DoctorLevel::Fail);
  EXPECT_EQ(check_disk("/nowhere").level, DoctorLevel::Fail);
  EXPECT_EQ(check_disk("/dev/null").level, DoctorLevel::Fail);
  testing::expect_on_page("doctor", check_disk("/dev/null").message);
  EXPECT_EQ(check_processor({}, {.images = 60, .dropped = 0, .share = 0.2}).level, DoctorLevel::Ok);
  EXPECT_EQ(check_processor({}, {.images = 60, .dropped = 1, .share = 0.7}).level, DoctorLevel::Warn);
  EXPECT_EQ(check_processor({}, {.images = 60, .dropped = 20, .share = 0.7}).level, DoctorLevel::Fail);
  EXPECT_EQ(check_processor({}, {.images = 0}).level, DoctorLevel::Fail);
  const LoopTrialResult late{.images = 60, .dropped = 30, .share = 1};
  EXPECT_THAT(check_processor({}, late).command, HasSubstr("rate_hz=15"));
}

TEST(Doctor, TheLoopTrialDetectsTagsAndMeasuresTime) {
  const auto finder = make_tag_finder();
  ASSERT_TRUE(finder);
  const auto result =
      try_loop(*finder, {.width = 320, .height = 240, .rate_hz = 20, .seconds = 0.5}, [] { return false; });
  ASSERT_TRUE(result);
  EXPECT_GT(result->images, 0);
  EXPECT_LE(result->images, 11);
  EXPECT_GT(result->share, 0);
  EXPECT_GT(result->median_ms, 0);
}

}  // namespace
}  // namespace waymark
