// Tests the warnings and the summary of a teach lap.
#include "waymark/pipeline/teacher.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

void see(TagLinks& links, const std::vector<int>& numbers, int frames) {
  std::vector<TagId> tags;
  tags.reserve(numbers.size());
  for (const int number : numbers) tags.push_back(tag(number));
  for (int i = 0; i < frames; ++i) links.add(tags);
}

SensorTime at(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

TEST(TagLinks, FindsLinksWithFewFrames) {
  TagLinks links;
  see(links, {0, 1}, 50);
  see(links, {1, 2}, 3);
  see(links, {2, 3}, 40);
  auto weak = links.weak(10);
  ASSERT_EQ(weak.size(), 1U);
  EXPECT_EQ(weak[0].first, tag(1));
  EXPECT_EQ(weak[0].second, tag(2));
  EXPECT_EQ(weak[0].frames, 3);
  // If a second chain of frames exists, the map does not depend on the weak link.
  see(links, {3, 0}, 30);
  EXPECT_TRUE(links.weak(10).empty());
  EXPECT_EQ(links.weak(45).size(), 2U);
  EXPECT_EQ(links.weak(45)[0].frames, 30) << "the weakest first";
}

TEST(TagLinks, FindsTagsNotConnectedToTheAnchor) {
  TagLinks links;
  see(links, {0, 1}, 5);
  see(links, {2, 3}, 5);
  see(links, {4}, 5);
  EXPECT_EQ(links.unreachable(tag(0)), (std::vector{tag(2), tag(3), tag(4)}));
  EXPECT_EQ(links.unreachable(tag(3)), (std::vector{tag(0), tag(1), tag(4)}));
  see(links, {1, 2, 4}, 1);
  EXPECT_TRUE(links.unreachable(tag(0)).empty());
}

TeachSetup setup_with(bool closed) {
  return {.camera =
              CameraModel::make(PinholeRadtan{.fx = 400, .fy = 400, .cx = 320, .cy = 240}, 640, 480).value(),
          .sizes = {.default_size_m = 0.16},
          .anchor = tag(0),
          .closed_route = closed};
}

/// A drive during which two tags ahead are always visible, at `speed_m_s` for `seconds`. The clock is off by
/// `jump_s` from `jump_at_s` on.
TeachSummary driven(bool closed, double seconds, double jump_at_s = 1e9, double jump_s = 0) {
  const std::array<Eigen::Vector2d, 4> corners{Eigen::Vector2d(300, 200), {340, 200}, {340, 240}, {300, 240}};
  Teacher teacher(setup_with(closed));
  for (int i = 0; i <= 10 * seconds; ++i) {
    const double t = 0.1 * i + (0.1 * i >= jump_at_s ? jump_s : 0);
    teacher.add(Odometry{.stamp = at(t), .odom_T_base = SE2(0.03 * i, 0, 0)});
    teacher.watch(TagFrame{
        .stamp = at(t + 0.01),
        .detections = {{.tag = tag(0), .corners_px = corners}, {.tag = tag(1), .corners_px = corners}}});
  }
  return teacher.summary();
}

std::string lines(const std::vector<std::string>& sentences) {
  std::string all;
  for (const std::string& sentence : sentences) all += sentence + "\n";
  return all;
}

TEST(Teacher, AShortDriveIsNotMappable) {
  const TeachSummary begun = driven(true, 3);
  EXPECT_FALSE(begun.mappable);
  EXPECT_FALSE(begun.closed_loop);
  testing::expect_on_page("session", lines(begun.warnings));
  EXPECT_TRUE(driven(true, 12).mappable);
  EXPECT_TRUE(driven(false, 3).mappable) << "an open route";
  EXPECT_FALSE(driven(false, 1).mappable);
}

TEST(Teacher, TagPosesCountLikeCorners) {
  Teacher teacher(setup_with(false));
  const SE3 ahead(SO3(), Eigen::Vector3d(0, 0, 1));
  for (int i = 0; i <= 40; ++i) {
    teacher.add(Odometry{.stamp = at(0.1 * i), .odom_T_base = SE2(0.03 * i, 0, 0)});
    teacher.watch(TagPoseFrame{.stamp = at(0.1 * i), .tags = {{tag(0), ahead}, {tag(1), ahead}}});
  }
  const TeachSummary summary = teacher.summary();
  EXPECT_EQ(summary.frames, 41);
  EXPECT_EQ(summary.seen.at(tag(1)), 41);
  EXPECT_TRUE(summary.anchor_at_start && summary.anchor_at_end);
  EXPECT_TRUE(summary.mappable);
}

TEST(Teacher, TagsWithUnreliableCornersCountSeparately) {
  Teacher teacher(setup_with(false));
  teacher.watch(
      TagFrame{.stamp = at(0.1),
               .detections = {{.tag = tag(1)}, {.tag = tag(2), .corner_state = CornerState::Unreliable}}});
  const TeachSummary summary = teacher.summary();
  EXPECT_EQ(summary.detections, 1);
  EXPECT_EQ(summary.unreliable, 1);
  EXPECT_FALSE(summary.seen.contains(tag(2)));
  EXPECT_EQ(summary.low_observability_frames, 1);
}

/// Drives once around an 8 m circle with the anchor at its centre, and 1.5 m further, or `most_m` in total.
TeachSummary driven_round(double most_m) {
  const double radius_m = 4 / std::numbers::pi;
  Teacher teacher(setup_with(true));
  for (int i = 0; 0.03 * i <= most_m; ++i) {
    const double angle = 0.03 * i / radius_m;
    teacher.add(Odometry{.stamp = at(0.1 * i), .odom_T_base = SE2(0.03 * i, 0, 0)});
    // The anchor faces up, so that its pose relative to the camera depends on the position on the circle.
    const SE3 cam_T_tag(SO3::exp({0, 0, angle}), Eigen::Vector3d(0, radius_m, 1));
    teacher.watch(TagPoseFrame{.stamp = at(0.1 * i), .tags = {{tag(0), cam_T_tag}, {tag(1), cam_T_tag}}});
  }
  return teacher.summary();
}

TEST(Teacher, ALapBeyondItsStartIsClosed) {
  const TeachSummary beyond = driven_round(9.5);
  EXPECT_TRUE(beyond.closed_loop) << "it passed its start; the last observation is 1.4 m beyond it";
  EXPECT_THAT(beyond.warnings, ::testing::Each(::testing::Not(::testing::HasSubstr(" m driven"))));
  EXPECT_TRUE(driven_round(8).closed_loop);
  const TeachSummary half = driven_round(5);
  EXPECT_FALSE(half.closed_loop) << "on the opposite side of the circle";
  EXPECT_THAT(half.warnings, ::testing::Contains(::testing::HasSubstr(" m driven")));
}

TEST(Teacher, ReportsClockJumps) {
  const TeachSummary back = driven(true, 12, 6, -2);
  EXPECT_FALSE(back.mappable);
  EXPECT_NEAR(back.clock_back_s, 1.91, 1e-6);
  EXPECT_THAT(lines(back.warnings), ::testing::HasSubstr(" 1.91 s"));
  testing::expect_on_page("session", lines(back.warnings));
  const TeachSummary ahead = driven(true, 12, 6, 2);
  EXPECT_EQ(ahead.clock_back_s, 0);
  EXPECT_NEAR(ahead.longest_silence_s, 2.09, 1e-6);
  testing::expect_on_page("session", lines(ahead.warnings));
  const TeachSummary well = driven(true, 12);
  EXPECT_EQ(well.clock_back_s, 0);
  EXPECT_LT(well.longest_silence_s, 0.5);
}

TEST(Teacher, ReportsARestartOfTheRobot) {
  Teacher teacher(setup_with(true));
  for (int i = 0; i < 100; ++i) {
    const double x_m = i < 60 ? 0.03 * i : 0.03 * (i - 60);
    const double t = i < 60 ? 0.1 * i : 0.1 * i + 0.4;
    teacher.add(Odometry{.stamp = at(t), .odom_T_base = SE2(x_m, 0, 0), .speed_m_s = 0.3});
    teacher.watch(TagFrame{.stamp = at(t + 0.01)});
  }
  const TeachSummary summary = teacher.summary();
  EXPECT_EQ(summary.odometry_jumps, 1);
  EXPECT_NEAR(summary.distance_m, 0.03 * (59 + 39), 1e-9) << "without the jump to the origin";
  EXPECT_FALSE(summary.mappable);
  EXPECT_THAT(lines(summary.warnings), ::testing::HasSubstr(" 1 time"));
  testing::expect_on_page("session", lines(summary.warnings));
  EXPECT_EQ(driven(true, 12).odometry_jumps, 0);
}

TEST(Teacher, ReportsLateImagesInsteadOfAClockJump) {
  Teacher teacher(setup_with(true));
  for (int i = 0; i < 120; ++i) {
    const double t = 0.1 * i;
    teacher.add(Odometry{.stamp = at(t), .odom_T_base = SE2(0.03 * i, 0, 0)});
    if (t >= 0.7) teacher.watch(TagFrame{.stamp = at(t - 0.7)});
  }
  const TeachSummary summary = teacher.summary();
  EXPECT_NEAR(summary.image_arrival_delay_s, 0.7, 1e-6);
  EXPECT_EQ(summary.clock_back_s, 0);
  EXPECT_THAT(lines(summary.warnings), ::testing::HasSubstr(" 0.70 s"));
  testing::expect_on_page("session", lines(summary.warnings));
}

TEST(Teacher, OdometryAndImagesOfTwoClocksAreReportedOnce) {
  Teacher teacher(setup_with(false));
  const SE3 ahead(SO3(), Eigen::Vector3d(0, 0, 1));
  for (int i = 0; i <= 40; ++i) {
    teacher.add(Odometry{.stamp = at(0.1 * i + 3600), .odom_T_base = SE2(0.03 * i, 0, 0)});
    teacher.watch(TagPoseFrame{.stamp = at(0.1 * i + 0.1), .tags = {{tag(0), ahead}, {tag(1), ahead}}});
  }
  const TeachSummary summary = teacher.summary();
  ASSERT_TRUE(summary.clocks_apart_s);
  EXPECT_NEAR(*summary.clocks_apart_s, 3600, 1);
  EXPECT_FALSE(summary.mappable);
  EXPECT_EQ(summary.clock_back_s, 0);
  EXPECT_EQ(summary.longest_silence_s, 0);
  ASSERT_EQ(summary.warnings.size(), 1U) << lines(summary.warnings);
  testing::expect_on_page("session", summary.warnings[0]);
  EXPECT_FALSE(driven(false, 3).clocks_apart_s);
}

/// Odometry of a drive of 3 m in a direction relative to the heading; positive angles are to the left.
TeachSummary driven_aside(double direction_rad) {
  Teacher teacher(setup_with(false));
  for (int i = 0; i <= 100; ++i) {
    const double way_m = 0.03 * i;
    teacher.add(
        Odometry{.stamp = at(0.1 * i),
                 .odom_T_base = SE2(way_m * std::cos(direction_rad), way_m * std::sin(direction_rad), 0)});
    teacher.watch(TagFrame{.stamp = at(0.1 * i)});
  }
  return teacher.summary();
}

TEST(Teacher, SidewaysMotionIsReported) {
  for (const double direction_rad : {0.0, 0.25, -0.25, std::numbers::pi})
    EXPECT_FALSE(driven_aside(direction_rad).sideways) << direction_rad;
  for (const double direction_rad : {0.5, -0.5, std::numbers::pi / 2, -std::numbers::pi / 2}) {
    const TeachSummary summary = driven_aside(direction_rad);
    ASSERT_TRUE(summary.sideways) << direction_rad;
    EXPECT_NEAR(summary.sideways->angle_rad, -direction_rad, 0.02);
    EXPECT_THAT(summary.warnings, ::testing::Contains(describe(*summary.sideways)));
  }
}

/// Drives 5 m straight past a tag that is this far to the side of the hull. Images have no noise.
TeachSummary driven_past(double clearance_m) {
  TeachSetup setup = setup_with(false);
  setup.hull = Hull{.front_m = 0.2, .rear_m = 0.1, .width_m = 0.2, .height_m = 0.25};
  setup.base_T_cam = SE3(body_R_optical(), {0.08, 0, 0.18});
  const SE3 odom_T_tag(SO3::from_rpy(-std::numbers::pi / 2, 0, 0), {3, 0.1 + clearance_m, 0.15});
  Teacher teacher(setup);
  for (int i = 0; i <= 166; ++i) {
    const SE2 odom_T_base(0.03 * i, 0, 0);
    const SE3 cam_T_tag = (lift(odom_T_base) * setup.base_T_cam).inverse() * odom_T_tag;
    TagFrame frame{.stamp = at(0.1 * i + 0.02)};
    if (const auto corners = visible_corners(setup.camera, cam_T_tag, 0.16))
      frame.detections.push_back({.tag = tag(7), .corners_px = *corners});
    teacher.watch(frame);  // before the odometry of the same time
    teacher.add(Odometry{.stamp = at(0.1 * i + 0.02), .odom_T_base = odom_T_base});
  }
  return teacher.summary();
}

TEST(Teacher, ATagThatIsPassedTooCloselyIsReported) {
  for (const double clearance_m : {0.05, 0.14, 0.16, 0.3}) {
    const TeachSummary summary = driven_past(clearance_m);
    ASSERT_TRUE(summary.nearest_tag) << clearance_m;
    EXPECT_EQ(summary.nearest_tag->tag, tag(7));
    EXPECT_NEAR(summary.nearest_tag->clearance_m, clearance_m, 0.005);
    EXPECT_NEAR(summary.nearest_tag->arc_length_m, 3, 0.3);
    const auto warned = std::ranges::count(summary.warnings, describe_too_near(*summary.nearest_tag));
    EXPECT_EQ(warned, clearance_m < SafetyOptions{}.min_clearance_m ? 1 : 0) << clearance_m;
  }
  EXPECT_FALSE(driven(false, 3).nearest_tag) << "the hull is unknown";
}

TEST(TeachMonitor, MotionBlurIsRateTimesExposureTimesFocalLength) {
  TeachMonitor monitor({.exposure_ms = 10, .focal_length_px = 442, .blur_px = 2});
  monitor.add(Odometry{.stamp = at(0), .yaw_rate_rad_s = -0.8});
  EXPECT_NEAR(monitor.motion_blur_px(), 0.8 * 0.010 * 442, 1e-12);
  ASSERT_EQ(monitor.live().size(), 1U);
  EXPECT_THAT(monitor.live()[0], ::testing::HasSubstr("3.5 px"));
  for (int i = 0; i < 10; ++i) monitor.add(TagFrame{.stamp = at(0.1 * i), .detections = {{}, {}}});
  monitor.add(Odometry{.stamp = at(1), .yaw_rate_rad_s = 0.1});
  for (int i = 0; i < 90; ++i) monitor.add(TagFrame{.stamp = at(1 + 0.1 * i), .detections = {{}, {}}});
  EXPECT_TRUE(monitor.live().empty());
  EXPECT_EQ(monitor.blurred_frames(), 10);
  ASSERT_EQ(monitor.summary().size(), 1U);
  EXPECT_THAT(monitor.summary()[0], ::testing::HasSubstr("10 %"));
  testing::expect_on_page("session", monitor.summary()[0]);
}

TEST(TeachMonitor, AbruptStartsAndStopsAreCountedOnceEach) {
  TeachMonitor monitor({.acceleration_m_s2 = 2});
  double speed = 0;
  const auto drive = [&](double acceleration, double from_s, double until_s) {
    for (double t = from_s; t < until_s - 1e-9; t += 0.02) {
      speed += acceleration * 0.02;
      monitor.add(Odometry{.stamp = at(t), .speed_m_s = speed});
    }
  };
  drive(1.5, 0, 0.4);
  EXPECT_EQ(monitor.abrupt_moments(), 0);
  drive(0, 0.4, 1);
  drive(-3, 1, 1.2);
  EXPECT_EQ(monitor.abrupt_moments(), 1);
  drive(0, 1.2, 2);
  EXPECT_EQ(monitor.abrupt_moments(), 1);
  monitor.add(Odometry{.stamp = at(0.5), .speed_m_s = 5});  // the clock jumped back
  EXPECT_EQ(monitor.acceleration_m_s2(), 0);
  ASSERT_EQ(monitor.summary().size(), 1U);
}

TEST(TeachMonitor, WarnsOfFewTagsInView) {
  TeachMonitor monitor({});
  monitor.add(TagFrame{.stamp = at(0)});
  testing::expect_on_page("session", lines(monitor.live()));
  monitor.add(TagFrame{.stamp = at(1), .detections = {{}}});
  testing::expect_on_page("session", lines(monitor.live()));
}

}  // namespace
}  // namespace waymark
