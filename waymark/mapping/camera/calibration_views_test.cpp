// The instructions given in a guided calibration, and the images that it selects.
#include "waymark/mapping/camera/calibration_views.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

/// A board in front of the camera, rotated about an axis given in camera axes.
SE3 board_turned(const Eigen::Vector3d& by_deg) {
  return SE3(SO3::exp(by_deg * to_radians(1)), {0, 0, 1}).inverse();
}

TEST(BoardTilt, IsTheNearerEdge) {
  EXPECT_EQ(board_tilt(board_turned({0, 0, 0})), BoardTilt::Frontal);
  EXPECT_EQ(board_tilt(board_turned({0, 0, 40})), BoardTilt::Frontal);
  for (const double roll_deg : {0.0, 90.0, 180.0}) {
    const SE3 roll(SO3::exp({0, 0, to_radians(roll_deg)}), {0, 0, 0});
    for (const auto& [by_deg, tilt] : {std::pair(Eigen::Vector3d(30, 0, 0), BoardTilt::UpperNearer),
                                       std::pair(Eigen::Vector3d(-30, 0, 0), BoardTilt::LowerNearer),
                                       std::pair(Eigen::Vector3d(0, 30, 0), BoardTilt::RightNearer),
                                       std::pair(Eigen::Vector3d(0, -30, 0), BoardTilt::LeftNearer)}) {
      const SE3 target_T_cam = (board_turned(by_deg).inverse() * roll).inverse();
      EXPECT_EQ(board_tilt(target_T_cam), tilt) << by_deg.transpose();
      // The result is compared with the depths of the edges themselves.
      const SE3 cam_T_target = board_turned(by_deg).inverse();
      const double left = (cam_T_target * Eigen::Vector3d(-1, 0, 0)).z();
      const double right = (cam_T_target * Eigen::Vector3d(1, 0, 0)).z();
      const double upper = (cam_T_target * Eigen::Vector3d(0, -1, 0)).z();
      const double lower = (cam_T_target * Eigen::Vector3d(0, 1, 0)).z();
      EXPECT_EQ(tilt == BoardTilt::LeftNearer, left < right - 0.1);
      EXPECT_EQ(tilt == BoardTilt::RightNearer, right < left - 0.1);
      EXPECT_EQ(tilt == BoardTilt::UpperNearer, upper < lower - 0.1);
      EXPECT_EQ(tilt == BoardTilt::LowerNearer, lower < upper - 0.1);
    }
  }
}

/// A grid of corners with the given pitch, whose upper left corner is at (x_px, y_px).
TargetMarks grid(double x_px, double y_px, double pitch_px = 12) {
  TargetMarks marks;
  for (int i = 0; i < 30; ++i)
    marks.push_back({.key = i,
                     .target_points_m = {{0.01 * (i % 6), 0.01 * (i / 6), 0}},
                     .seen_px = {{x_px + pitch_px * (i % 6), y_px + pitch_px * (i / 6)}}});
  return marks;
}

TEST(ViewCoverage, RequestsMissingViewsUntilComplete) {
  ViewCoverage coverage;
  EXPECT_THAT(missing_views(coverage), Contains(HasSubstr("12 more")));
  for (const std::string& request : missing_views(coverage)) testing::expect_on_page("calibrate", request);
  const auto view = [&](double x_px, double y_px, const Eigen::Vector3d& by_deg) {
    add_view(coverage, grid(x_px, y_px), board_turned(by_deg), 640, 480);
  };
  for (int i = 0; i < 9; ++i) view(20 + 213 * (i % 3), 20 + 160 * (i / 3), {0, 0, 0});
  const auto tilts = missing_views(coverage);
  EXPECT_THAT(tilts, Not(Contains(HasSubstr("parts of the image"))));
  EXPECT_THAT(tilts, Contains(HasSubstr("left, right, upper or lower edge")));
  for (const Eigen::Vector3d& by_deg : {Eigen::Vector3d(30, 0, 0), Eigen::Vector3d(-30, 0, 0),
                                        Eigen::Vector3d(0, 30, 0), Eigen::Vector3d(0, -30, 0)})
    for (int i = 0; i < 2; ++i) {
      if (by_deg.y() < 0 && i == 1)
        EXPECT_THAT(missing_views(coverage),
                    ElementsAre(AllOf(HasSubstr("left"), Not(HasSubstr("right")), Not(HasSubstr("upper")))));
      view(200, 200, by_deg);
    }
  EXPECT_TRUE(missing_views(coverage).empty());
}

TEST(ViewCoverage, ReportsEmptyPartsOfTheImage) {
  ViewCoverage coverage;
  for (int i = 0; i < 9; ++i)
    if (i != 2 && i != 6)
      add_view(coverage, grid(20 + 213 * (i % 3), 20 + 160 * (i / 3)), board_turned({0, 0, 0}), 640, 480);
  EXPECT_THAT(missing_views(coverage), Contains(HasSubstr("top right, bottom left")));
}

/// A pattern of 12 px squares with blurred edges that starts at (40, 40), so that its corners match those of
/// grid().
Image squares(double blur_px) {
  Image image(640, 480, 128);
  const auto soft = [&](double v) {  // a blurred square wave between +1 and -1
    const double phase = v / 12;
    const double nearest = 12 * std::abs(phase - std::round(phase));
    const double side = static_cast<int>(std::floor(phase)) % 2 == 0 ? 1 : -1;
    return side * std::erf(nearest / (blur_px * std::sqrt(2.0)));
  };
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x)
      image.row(y)[x] = static_cast<std::uint8_t>(128 + 100 * soft(x + 0.5 - 40) * soft(y + 0.5 - 40));
  return image;
}

TEST(EdgeWidth, IsTheBlurOfTheImage) {
  for (const double blur_px : {1.0, 1.5, 2.5}) {
    const auto width = edge_width_px(squares(blur_px), grid(40, 40));
    ASSERT_TRUE(width);
    EXPECT_NEAR(*width, blur_px, 0.25 * blur_px + 0.2);
  }
  EXPECT_FALSE(edge_width_px(Image(640, 480, 90), grid(40, 40)));
  EXPECT_FALSE(edge_width_px(squares(1), grid(-500, -500)));
}

/// A stream of images that are 33 ms apart.
struct Stream {
  ViewCapture capture{};
  int k = 0;
  CaptureVerdict show(const TargetMarks& marks, const Image& image) {
    return capture.take(SensorTime(std::chrono::milliseconds(33 * k++)), image, marks);
  }
};

TEST(ViewCapture, TakesStillSharpAndNewImages) {
  const Image sharp = squares(1);
  Stream stream;
  EXPECT_EQ(stream.show({}, sharp), CaptureVerdict::NoTarget);
  // The board may have just entered the image.
  EXPECT_EQ(stream.show(grid(40, 40), sharp), CaptureVerdict::Moving);
  EXPECT_EQ(stream.show(grid(40, 40), sharp), CaptureVerdict::Moving);
  EXPECT_EQ(stream.show(grid(40, 40), sharp), CaptureVerdict::New);
  EXPECT_EQ(stream.show(grid(40, 40), sharp), CaptureVerdict::Known);
  for (int i = 1; i < 8; ++i)
    EXPECT_NE(stream.show(grid(40 + 24 * i, 40), sharp), CaptureVerdict::New);  // at 727 px/s
  EXPECT_EQ(stream.show(grid(232, 40), sharp), CaptureVerdict::Moving);
  EXPECT_EQ(stream.show(grid(232, 40), sharp), CaptureVerdict::Moving);
  EXPECT_EQ(stream.show(grid(232, 40), sharp), CaptureVerdict::New);
}

TEST(ViewCapture, RejectsBlurredOrSparseImages) {
  Stream stream;
  for (int i = 0; i < 5; ++i) EXPECT_NE(stream.show(grid(40, 40), squares(4)), CaptureVerdict::New);
  EXPECT_EQ(stream.show(grid(40, 40), squares(4)), CaptureVerdict::Blurred);
  TargetMarks few = grid(40, 40);
  few.resize(10);
  EXPECT_EQ(stream.show(few, squares(1)), CaptureVerdict::TooFew);
}

TEST(ViewCapture, DoesNotTakeEarlierViewsAgain) {
  Stream stream;
  stream.capture.add(grid(40, 40));
  for (int i = 0; i < 4; ++i) EXPECT_EQ(stream.show(grid(42, 41), squares(1)), CaptureVerdict::Known);
}

}  // namespace
}  // namespace waymark
