// Tests the filter, fed sample by sample in a ring of tags: late samples, wrong tags, uncertainty and invalid
// input.
#include "waymark/localization/riekf_localizer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/tag_ring.hpp"
#include "waymark/geometry/lie.hpp"

namespace waymark {
namespace {

using testing::at;
using testing::certain;
using testing::mounted_sensor;
using testing::observe;
using testing::off_m;
using testing::ring;
using testing::RingRobot;
using testing::RingWorld;
using testing::run;

/// The filter's findings, one per line.
std::string findings(const RiekfLocalizer& filter) {
  std::string lines;
  for (const std::string& problem : filter.problems()) lines += problem + "\n";
  return lines;
}

TEST(RiekfLocalizer, InitialisesAndTracks) {
  RiekfLocalizer filter(Landmarks(ring()), mounted_sensor());
  RingRobot robot;
  Random random(1);
  run(filter, robot, {}, 1, random);
  EXPECT_TRUE(certain(filter));
  run(filter, robot, {}, 20, random);
  EXPECT_LT(off_m(filter, robot), 0.02);
  EXPECT_TRUE(filter.problems().empty());
}

/// Detections from a camera with a different lens and mounting.
TagFrame frame_of(const MountedCamera& camera, const SE2& map_X_base, double seconds, Random& random) {
  TagFrame frame{.stamp = at(seconds), .camera = camera.name};
  const SE3 cam_T_map = (lift(map_X_base) * camera.base_T_cam).inverse();
  for (const auto& [id, tag] : ring().tags) {
    const auto corners = visible_corners(camera.camera, cam_T_map * tag.map_T_tag, tag.size_m);
    if (!corners) continue;
    TagDetection seen{.tag = id, .corners_px = *corners};
    for (auto& corner : seen.corners_px) corner += 0.15 * Eigen::Vector2d(random.normal(), random.normal());
    seen.corner_covariance_px2 = CornerCovariance::Identity() * 0.15 * 0.15;
    frame.detections.push_back(seen);
  }
  return frame;
}

TEST(RiekfLocalizer, ARearCameraSufficesWithItsOwnMounting) {
  const PinholeRadtan lens{.fx = 380, .fy = 380, .cx = 310, .cy = 250, .k = {}, .coefficients = 0};
  const MountedCamera rear{
      .name = "rear",
      .camera = CameraModel::make(lens, 640, 480).value(),
      .base_T_cam = base_T_camera({.x_m = -0.12, .z_m = 0.2, .yaw_rad = std::numbers::pi})};
  MountedSensor eyes = mounted_sensor();
  eyes.more_cameras = {rear};
  const auto drive = [&](const MountedSensor& sensor) {
    RiekfLocalizer filter(Landmarks(ring()), sensor);
    RingRobot robot;
    Random random(7);
    for (int i = 0; i < 600; ++i) {
      filter.add(robot.drive(0.02, random));
      if (robot.steps % 4 == 0) filter.add(frame_of(rear, robot.truth, robot.seconds, random));
    }
    return std::pair(certain(filter), off_m(filter, robot));
  };
  const auto [sure, off] = drive(eyes);
  EXPECT_TRUE(sure);
  EXPECT_LT(off, 0.02);
  const auto [certain_without, off_without] = drive(mounted_sensor());
  EXPECT_FALSE(certain_without && off_without < 0.1) << "nothing fits with the mounting of the front camera";
}

/// Like observe(), with each corner captured at the time of its row while the robot drives.
TagFrame observe_rolling(const SE2& map_X_base, double seconds, double readout_s, Random& random) {
  TagFrame frame = observe({}, map_X_base, seconds, random);
  const CameraModel& camera = *mounted_sensor().camera;
  for (TagDetection& seen : frame.detections) {
    const MappedTag& tag = ring().tags.at(seen.tag);
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector3d map_p = tag.map_T_tag * tag_corners(tag.size_m)[i];
      const Eigen::Vector2d noise(0.15 * random.normal(), 0.15 * random.normal());
      double t = 0;
      for (int k = 0; k < 5; ++k) {
        const SE2 then = map_X_base * SE2::exp(Eigen::Vector3d(0.3, 0, 0.3) * t);
        const auto px = camera.project((lift(then) * mounted_sensor().base_T_sensor).inverse() * map_p);
        if (!px) break;
        seen.corners_px[i] = *px + noise;
        t = row_time_s(px->y(), camera.height_px(), readout_s);
      }
    }
  }
  return frame;
}

TEST(RiekfLocalizer, AKnownReadoutTimeCorrectsTheRollingShutter) {
  constexpr double kReadout_s = 0.1;  // the tags are above the middle row and are exposed up to 20 ms earlier
  const auto mean_nis = [&](double readout_s, double& off) {
    RiekfOptions options;
    options.camera_readout_s = readout_s;
    RiekfLocalizer filter(Landmarks(ring()), mounted_sensor(), options);
    RingRobot robot;
    Random random(12);
    double sum = 0;
    double rows = 0;
    double square = 0;
    int frames = 0;
    for (int i = 0; i < 1500; ++i) {
      filter.add(robot.drive(0.02, random));
      if (robot.steps % 4 == 0) filter.add(observe_rolling(robot.truth, robot.seconds, kReadout_s, random));
      for (const NisRecord& record : filter.comparisons()) {
        if (i < 250) continue;
        sum += record.nis;
        rows += record.rows;
      }
      filter.clear_comparisons();
      if (i < 250 || robot.steps % 4 != 0) continue;
      square += std::pow(off_m(filter, robot), 2);
      ++frames;
    }
    off = std::sqrt(square / frames);
    return sum / rows;
  };
  double off_known = 0;
  double off_unknown = 0;
  const double known = mean_nis(kReadout_s, off_known);
  const double unknown = mean_nis(0, off_unknown);
  EXPECT_LT(known, 1.2);
  EXPECT_GT(unknown, 2 * known);
  EXPECT_LT(off_known, 0.7 * off_unknown) << off_known << " m compared with " << off_unknown << " m";
}

TEST(RiekfLocalizer, OneTagAloneIsReportedAsUncertain) {
  RingWorld world;
  const MappedTag only = world.tags.tags.at({.number = 0});
  world.tags.tags = {{{.number = 0}, only}};
  RiekfLocalizer filter(Landmarks(ring()), mounted_sensor());
  RingRobot robot{.truth = SE2(0, 0, 0)};
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    filter.add(Odometry{.stamp = at(10 + 0.02 * i)});
    filter.add(observe(world, robot.truth, 10 + 0.02 * i, random));
  }
  ASSERT_TRUE(filter.estimate());
  EXPECT_FALSE(filter.estimate()->certain);
}

/// Frames that arrive up to one second late result in the same estimate as frames in order.
TEST(RiekfLocalizer, LateFramesGiveTheSameEstimate) {
  const auto estimate_with = [](int late_steps) {
    RiekfLocalizer filter(Landmarks(ring()), mounted_sensor());
    RingRobot robot;
    Random random(3);
    std::vector<std::pair<int, TagFrame>> waiting;
    for (int i = 0; i < 400; ++i) {
      const Odometry odometry = robot.drive(0.02, random);
      // Some frames lie between two odometry messages, and some are out of order.
      if (i % 4 == 0)
        waiting.emplace_back(i + (i % 8 == 0 ? late_steps : late_steps / 3),
                             observe({}, robot.truth, robot.seconds - 0.007, random));
      filter.add(odometry);
      for (auto& [due, frame] : waiting) {
        if (due == i || (i == 399 && due > i)) filter.add(frame);
      }
    }
    EXPECT_EQ(filter.too_late(), 0);
    EXPECT_GE(filter.rewinds(), late_steps > 0 ? 50 : 0);
    return *filter.estimate();
  };
  const LocalizationEstimate in_time = estimate_with(0);
  for (const int late : {3, 20, 44}) {
    const LocalizationEstimate delayed = estimate_with(late);
    EXPECT_LT(minus(in_time.map_T_base, delayed.map_T_base).norm(), 1e-12) << late;
    EXPECT_LT((in_time.covariance - delayed.covariance).norm(), 1e-12) << late;
  }
}

TEST(RiekfLocalizer, SigmaGrowsInTheDarkAndShrinksWithTheFirstTags) {
  RiekfLocalizer filter(Landmarks(ring()), mounted_sensor());
  RingRobot robot;
  Random random(4);
  RingWorld world;
  run(filter, robot, world, 5, random);
  const double before = filter.estimate()->position_sigma_m();
  world.dark = true;
  run(filter, robot, world, 5, random);
  const double dark = filter.estimate()->position_sigma_m();
  EXPECT_GT(dark, 2 * before);
  EXPECT_LT(off_m(filter, robot), 4 * dark);
  world.dark = false;
  run(filter, robot, world, 1, random);
  EXPECT_LT(filter.estimate()->position_sigma_m(), dark / 2);
  EXPECT_LT(off_m(filter, robot), 0.03);
}

struct WrongTag {
  const char* name;
  void (*change)(TagMap& tags);
  std::vector<std::string> parts;  ///< ids and values that the finding must contain
  bool map_is_wrong = false;       ///< the map is changed rather than the tags on the walls
};

class WrongTags : public ::testing::TestWithParam<WrongTag> {};

TEST_P(WrongTags, AreReportedAndExcluded) {
  RingWorld world;
  TagMap map = ring();
  GetParam().change(GetParam().map_is_wrong ? map : world.tags);
  RiekfLocalizer filter(Landmarks(map), mounted_sensor());
  RingRobot robot;
  Random random(5);
  run(filter, robot, world, 30, random);
  for (const std::string& part : GetParam().parts) EXPECT_THAT(findings(filter), ::testing::HasSubstr(part));
  EXPECT_EQ(filter.problems().size(), 1U) << findings(filter);
  testing::expect_on_page("localize", findings(filter));
  EXPECT_TRUE(certain(filter));
  EXPECT_LT(off_m(filter, robot), 0.03);
}

INSTANTIATE_TEST_SUITE_P(
    All, WrongTags,
    ::testing::Values(WrongTag{"swapped",
                               [](TagMap& real) {
                                 std::swap(real.tags.at({.number = 4}).map_T_tag,
                                           real.tags.at({.number = 6}).map_T_tag);
                               },
                               {"tag36h11:4", "tag36h11:6"}},
                      WrongTag{"moved",
                               [](TagMap& real) {
                                 SE3& T = real.tags.at({.number = 3}).map_T_tag;
                                 T = SE3(T.rotation(), T.translation() + Eigen::Vector3d(-0.3, 0.4, 0));
                               },
                               {"tag36h11:3", " 0.5"}},
                      // The tag's position in the map is not visible from anywhere on the path.
                      WrongTag{"misplaced_by_kilometres",
                               [](TagMap& map) {
                                 SE3& T = map.tags.at({.number = 3}).map_T_tag;
                                 T = SE3(T.rotation(), T.translation() + Eigen::Vector3d(5000, 0, 0));
                               },
                               {"tag36h11:3", " 5000.0"},
                               true},
                      WrongTag{"misplaced_by_kilometres_in_the_opposite_direction",
                               [](TagMap& map) {
                                 SE3& T = map.tags.at({.number = 3}).map_T_tag;
                                 T = SE3(T.rotation(), T.translation() - Eigen::Vector3d(5000, 0, 0));
                               },
                               {"tag36h11:3", " 5000.0"},
                               true},
                      WrongTag{"larger",
                               [](TagMap& real) { real.tags.at({.number = 8}).size_m = 0.2; },
                               {"tag36h11:8", " 0.20"}}),
    [](const auto& of) { return of.param.name; });

TEST(RiekfLocalizer, ReportsInvalidInputAndIgnoresIt) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  RiekfLocalizer filter(Landmarks(ring()), mounted_sensor());
  RingRobot robot;
  Random random(6);
  run(filter, robot, {}, 3, random);
  TagFrame frame = observe({}, robot.truth, robot.seconds, random);
  for (TagDetection& seen : frame.detections) {
    seen.corners_px[1].x() = nan;
    seen.corner_covariance_px2->setZero();
  }
  filter.add(frame);
  filter.add(ImuSample{.stamp = at(robot.seconds), .angular_velocity_rad_s = {0, 0, nan}});
  filter.add(Odometry{.stamp = at(robot.seconds - 1), .odom_T_base = robot.odom});
  TagFrame old = observe({}, robot.truth, robot.seconds - 100, random);
  filter.add(old);
  filter.add(RangeBearing{at(robot.seconds), 3, nan, 0});
  filter.add(RangeBearing{at(robot.seconds), 3, -1, 0});
  run(filter, robot, {}, 2, random);
  ASSERT_TRUE(filter.estimate());
  EXPECT_TRUE(filter.estimate()->covariance.allFinite());
  EXPECT_LT(off_m(filter, robot), 0.03);
  EXPECT_GE(filter.problems().size(), 3U) << findings(filter);
  EXPECT_EQ(filter.too_late(), 1);
  testing::expect_on_page("localize", findings(filter));
}

TEST(RiekfLocalizer, ReportsAMapOfAnotherPlaceOrFamily) {
  Random random(7);
  TagMap others;
  for (const auto& [id, tag] : ring().tags) others.tags[{FamilyId::Tag25h9, id.number}] = tag;
  RiekfLocalizer other_family(Landmarks(others), mounted_sensor());
  RingRobot robot;
  run(other_family, robot, {}, 2, random);
  EXPECT_FALSE(other_family.estimate());
  testing::expect_on_page("localize", findings(other_family));

  TagMap shuffled;  // every tag is in a different position
  for (const auto& [id, tag] : ring().tags) shuffled.tags[{.number = (7 * id.number + 3) % 16}] = tag;
  RiekfLocalizer nonsense(Landmarks(shuffled), mounted_sensor());
  run(nonsense, robot, {}, 4, random);
  EXPECT_FALSE(certain(nonsense));
}

TEST(RiekfLocalizer, UnreliableCornersAreNotUsedAndReported) {
  const auto drive = [](bool marked) {
    RiekfLocalizer filter(Landmarks(ring()), mounted_sensor());
    RingRobot robot;
    Random random(8);
    for (int i = 0; i < 400; ++i) {
      filter.add(robot.drive(0.02, random));
      if (robot.steps % 4 != 0) continue;
      TagFrame frame = observe({}, robot.truth, robot.seconds, random);
      for (TagDetection& seen : frame.detections) {
        if (!marked) continue;
        for (auto& corner : seen.corners_px) corner.x() += 40;
        seen.corner_state = CornerState::Unreliable;
      }
      filter.add(frame);
    }
    return findings(filter) + (filter.estimate() ? "localised" : "no estimate");
  };
  EXPECT_EQ(drive(false), "localised");
  const std::string marked = drive(true);
  EXPECT_THAT(marked, ::testing::HasSubstr("unreliable"));
  EXPECT_THAT(marked, ::testing::EndsWith("no estimate"));
}

/// For three seconds, the encoders report standstill although the robot is driving; the tags reveal the
/// motion.
TEST(RiekfLocalizer, DetectsEncodersThatStopWhileTheRobotDrives) {
  RiekfLocalizer filter(Landmarks(ring()), mounted_sensor());
  RingRobot robot;
  Random random(8);
  run(filter, robot, {}, 3, random);
  ASSERT_TRUE(certain(filter));
  double squares = 0;
  int looks = 0;
  double worst_m = 0;
  for (int i = 0; i < 250; ++i) {
    const SE2 before = robot.odom;
    Odometry odometry = robot.drive(0.02, random);
    const bool stuck = i < 150;
    if (stuck) odometry.odom_T_base = robot.odom = before;
    filter.add(odometry);
    if (robot.steps % 4 != 0) continue;
    filter.add(observe({}, robot.truth, robot.seconds, random));
    worst_m = std::max(worst_m, off_m(filter, robot));
    const auto estimate = filter.estimate();
    ASSERT_TRUE(estimate);
    const Eigen::Vector2d off = estimate->map_T_base.translation() - robot.truth.translation();
    squares += off.dot(estimate->covariance.topLeftCorner<2, 2>().inverse() * off) / 2;
    ++looks;
  }
  EXPECT_LT(worst_m, 0.05);
  EXPECT_LT(squares / looks, 3) << "NEES with two degrees of freedom, divided by two";
}

/// Images are stamped 80 ms too late: the latency is estimated during the drive and used from then on.
TEST(RiekfLocalizer, EstimatesTheCameraLatencyDuringTheDrive) {
  for (const bool estimates : {false, true}) {
    RiekfLocalizer filter(Landmarks(ring()), mounted_sensor());
    if (estimates) filter.estimate_camera_latency();
    RingRobot robot;
    Random random(9);
    std::vector<std::pair<int, TagFrame>> waiting;
    for (int i = 0; i < 6000; ++i) {
      const double way = 0.02 * (0.3 + 0.25 * std::sin(0.02 * i));
      robot.truth = robot.truth * SE2::exp({way, 0, way});
      robot.odom = robot.odom * SE2::exp({1.02 * way, 0, way + 1e-4 * random.normal()});
      robot.seconds += 0.02;
      filter.add(Odometry{.stamp = at(robot.seconds), .odom_T_base = robot.odom});
      if (i % 4 != 0) continue;
      TagFrame frame = observe({}, robot.truth, robot.seconds, random);
      frame.stamp += std::chrono::milliseconds(80);
      waiting.emplace_back(i + 4, frame);
      if (waiting.front().first <= i) {
        filter.add(waiting.front().second);
        waiting.erase(waiting.begin());
      }
      filter.clear_comparisons();
    }
    if (!estimates) {
      EXPECT_DOUBLE_EQ(filter.camera_latency_s(), 0);
      continue;
    }
    EXPECT_NEAR(filter.camera_latency_s(), 0.08, 0.02);
    testing::expect_on_page("localize", findings(filter));
  }
}

}  // namespace
}  // namespace waymark
