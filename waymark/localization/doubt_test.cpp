// What the filter is told wrongly, it notices: a start, odometry that jumps, where the sensor sits.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/localization/fixed_lag_smoother.hpp"
#include "waymark/localization/riekf_localizer.hpp"
#include "waymark/localization/smoother.hpp"

namespace waymark {
namespace {

SensorTime at(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

/// Eight points around, not evenly.
std::vector<LandmarkPoint> points() {
  std::vector<LandmarkPoint> all;
  for (int i = 0; i < 8; ++i) {
    const double angle = 0.785 * i + 0.3 * std::sin(5.0 * i);
    all.push_back({i + 1, {(2.5 + 0.2 * i) * std::cos(angle), (3 - 0.15 * i) * std::sin(angle)}});
  }
  return all;
}

/// A robot with a laser that drives in circles.
struct Robot {
  SE2 truth{0, -1, 0};
  SE2 odom{};
  double seconds = 10;
  double laser_x_m = 0;
  Random random{3};
  std::size_t in_view = 8;  ///< points

  void drive(RiekfLocalizer& filter, double duration_s, bool sees = true) {
    for (int i = 0; i < std::lround(duration_s * 50); ++i) {
      const Eigen::Vector3d u(0.006, 0, 0.006);
      truth = truth * SE2::exp(u);
      odom = odom * SE2::exp({u.x() + 2e-4 * random.normal(), 0, u.z() + 2e-4 * random.normal()});
      seconds += 0.02;
      filter.add(Odometry{.stamp = at(seconds), .odom_T_base = odom});
      if (i % 5 == 0 && sees) observe(filter);
      filter.clear_comparisons();
    }
  }

 private:
  void observe(RiekfLocalizer& filter) {
    for (const LandmarkPoint& point : points()) {
      if (static_cast<std::size_t>(point.number) > in_view) continue;
      const Eigen::Vector2d p = (truth * SE2(laser_x_m, 0, 0)).inverse() * point.map_p;
      filter.add(RangeBearing{at(seconds), point.number, p.norm() + 0.03 * random.normal(),
                              std::atan2(p.y(), p.x()) + 0.026 * random.normal()});
    }
  }
};

RiekfLocalizer filter_of(const RiekfOptions& options = {}) {
  return {Landmarks::of_points(points()).value(), MountedSensor{}, options};
}

double off_m(const RiekfLocalizer& filter, const Robot& robot) {
  return (filter.estimate()->map_T_base.translation() - robot.truth.translation()).norm();
}

bool says(const RiekfLocalizer& filter, const std::string& words) {
  for (const std::string& problem : filter.problems())
    if (problem.find(words) != std::string::npos) return true;
  return false;
}

TEST(AStartThatIsGiven, IsCertainWhenTheFirstTagsAgree) {
  RiekfLocalizer filter = filter_of();
  Robot robot;
  filter.start_from(robot.truth, 0.05, 0.05);
  robot.drive(filter, 1, false);
  ASSERT_TRUE(filter.estimate());
  EXPECT_FALSE(filter.estimate()->certain) << "nobody has confirmed it";
  robot.drive(filter, 0.3);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_LT(off_m(filter, robot), 0.1);
  EXPECT_TRUE(filter.problems().empty());
}

TEST(AStartThatIsGiven, IsGivenUpWhenTheyDoNot) {
  for (const SE2& off : {SE2(1.5, 1, 1), SE2(0, 0, 3), SE2(-0.5, 0, 0)}) {
    RiekfLocalizer filter = filter_of();
    Robot robot;
    filter.start_from(robot.truth * off, 0.05, 0.05);
    int certain_and_wrong = 0;
    for (int i = 0; i < 100; ++i) {
      robot.drive(filter, 0.02);
      certain_and_wrong += filter.estimate()->certain && off_m(filter, robot) > 0.2 ? 1 : 0;
    }
    EXPECT_EQ(certain_and_wrong, 0) << off.x();
    EXPECT_TRUE(filter.estimate()->certain) << off.x();
    EXPECT_LT(off_m(filter, robot), 0.1) << off.x();
    EXPECT_TRUE(says(filter, "assumed start")) << off.x();
  }
}

// Pictures come late: what was seen before somebody said where the robot is must not bring back the old
// place.
TEST(APoseThatIsGivenInTheMiddle, CountsWhateverWasEstimatedBefore) {
  RiekfLocalizer filter = filter_of();
  Robot robot;
  robot.drive(filter, 3);
  ASSERT_TRUE(filter.estimate()->certain);
  const Robot before = robot;
  robot.truth = SE2(-1, 1, 2);  // carried
  ASSERT_TRUE(filter.restart_from(
      {robot.truth * SE2(0.02, 0.02, 0.02), Eigen::Vector3d(4e-3, 4e-3, 4e-3).asDiagonal()}));
  EXPECT_LT(off_m(filter, robot), 0.03);
  EXPECT_FALSE(filter.estimate()->certain) << "no tag has said so";
  for (const LandmarkPoint& point : points()) {
    const Eigen::Vector2d p = before.truth.inverse() * point.map_p;
    filter.add(RangeBearing{at(before.seconds - 0.05), point.number, p.norm(), std::atan2(p.y(), p.x())});
  }
  robot.drive(filter, 0.06, false);
  EXPECT_LT(off_m(filter, robot), 0.05) << "what was seen before the robot was carried says nothing";
  robot.drive(filter, 0.3);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_LT(off_m(filter, robot), 0.1);
  EXPECT_TRUE(filter.problems().empty()) << "it was not lost";
}

TEST(APoseThatIsGivenInTheMiddle, IsGivenUpWhenTagsContradict) {
  RiekfLocalizer filter = filter_of();
  Robot robot;
  robot.drive(filter, 3);
  filter.restart_from({robot.truth * SE2(1, 1, 1), Eigen::Vector3d(0.01, 0.01, 0.01).asDiagonal()});
  int certain_and_wrong = 0;
  for (int i = 0; i < 100; ++i) {
    robot.drive(filter, 0.02);
    certain_and_wrong += filter.estimate()->certain && off_m(filter, robot) > 0.2 ? 1 : 0;
  }
  EXPECT_EQ(certain_and_wrong, 0);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_LT(off_m(filter, robot), 0.1);
}

// What is said of it is what happened: one tag refutes a pose and gives none, two give another.
TEST(APoseThatIsGivenInTheMiddle, IsNotCalledLocalisedBeforeTwoTagsAgree) {
  RiekfLocalizer filter = filter_of();
  Robot robot;
  robot.drive(filter, 3);
  robot.in_view = 1;
  filter.restart_from({robot.truth * SE2(1, 1, 1), Eigen::Vector3d(0.01, 0.01, 0.01).asDiagonal()});
  robot.drive(filter, 1);
  EXPECT_FALSE(filter.estimate()->certain);
  EXPECT_TRUE(says(filter, "do not agree with the pose that was given: the robot is not localised"))
      << ::testing::PrintToString(filter.problems());
  robot.in_view = 8;
  robot.drive(filter, 2);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_TRUE(
      says(filter, "do not agree with the pose that was given: the robot was localised from the tags"))
      << ::testing::PrintToString(filter.problems());
  EXPECT_FALSE(says(filter, "lost and found"));
}

TEST(OdometryThatJumps, IsSaidAndTheRobotIsLookedForAnew) {
  RiekfLocalizer filter = filter_of();
  Robot robot;
  robot.drive(filter, 3);
  ASSERT_TRUE(filter.estimate() && filter.estimate()->certain);
  robot.odom = SE2(40, -7, 2);  // the counter was set back, and the robot was carried
  robot.truth = SE2(0.5, 0.5, -2);
  int certain_and_wrong = 0;
  for (int i = 0; i < 100; ++i) {
    robot.drive(filter, 0.02);
    certain_and_wrong +=
        filter.estimate() && filter.estimate()->certain && off_m(filter, robot) > 0.3 ? 1 : 0;
  }
  EXPECT_EQ(certain_and_wrong, 0);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_LT(off_m(filter, robot), 0.1);
  EXPECT_TRUE(says(filter, "odometry jumped 1 time"));
}

TEST(ARobotThatIsCarried, IsSaidToHaveBeenLostAndFound) {
  RiekfLocalizer filter = filter_of();
  Robot robot;
  robot.drive(filter, 3);
  EXPECT_FALSE(says(filter, "lost"));
  robot.truth = SE2(0.5, 0.5, -2);  // the wheels know nothing of it
  robot.drive(filter, 3);
  EXPECT_LT(off_m(filter, robot), 0.1);
  EXPECT_TRUE(says(filter, "lost and found again, 1 time")) << ::testing::PrintToString(filter.problems());
}

/// Two tags of one number, each seen as often as the other: none contradicts most of the time.
TEST(TagWatch, NamesANumberThatHangsInTwoPlaces) {
  const Landmarks landmarks = Landmarks::of_points(points()).value();
  TagWatch watch(landmarks);
  const Eigen::Vector2d second = landmarks[2].map_T_tag.translation().head<2>() + Eigen::Vector2d(1, 0.5);
  for (int i = 0; i < 100; ++i) {
    watch.add({.landmark = 1, .nis_per_row = 1, .accepted = true});
    watch.add({.landmark = 2, .nis_per_row = 1, .accepted = true});
    watch.add({.landmark = 2, .nis_per_row = 300, .map_p_implied = second});
    watch.confirm();
  }
  ASSERT_EQ(watch.findings().size(), 1U);
  EXPECT_NE(watch.findings().front().find("tag 3 is seen where the map says and 1.12 m from there"),
            std::string::npos)
      << watch.findings().front();
}

/// Single observations look right when the laser sits elsewhere; the innovations tell that it does, and no
/// healthy run says so.
TEST(SystematicErrors, OfALaserThatSitsElsewhereAreNamed) {
  for (const double laser_x_m : {0.0, 0.5}) {
    RiekfLocalizer filter = filter_of();
    Robot robot{.laser_x_m = laser_x_m};
    filter.start_from(robot.truth, 0.05, 0.05);
    robot.drive(filter, 60);
    const auto lasting = filter.tracker().lasting_nis();
    ASSERT_TRUE(lasting);
    if (laser_x_m > 0) {
      EXPECT_GT(*lasting, 2);
      EXPECT_TRUE(says(filter, "wrong sensor mounting") || says(filter, "overconfident"));
    } else {
      EXPECT_GT(*lasting, 0.1);  // what is wrong with the estimate is in it as well
      EXPECT_LT(*lasting, 1.5);
      EXPECT_TRUE(filter.problems().empty());
    }
  }
}

/// Landmarks that hang elsewhere than the map says, each by a lasting error: hindsight is no worse.
TEST(Smoother, LastingErrorsOfLandmarksDoNotMakeHindsightWorse) {
  double filtered2 = 0;
  double smoothed2 = 0;
  for (int seed = 0; seed < 4; ++seed) {
    RiekfOptions options;
    options.tag_sigma_m = 0.05;
    options.tag_time_s = 1e4;
    std::vector<LandmarkPoint> told = points();
    Robot robot{.random = Random(static_cast<std::uint64_t>(20 + seed))};
    for (LandmarkPoint& point : told)
      point.map_p += 0.05 * Eigen::Vector2d(robot.random.normal(), robot.random.normal());
    RiekfLocalizer filter(Landmarks::of_points(told).value(), {}, options);
    filter.tracker().keep_trace();
    filter.start_from(robot.truth, 0.05, 0.05);
    std::vector<std::pair<SensorTime, SE2>> truth;
    for (int i = 0; i < 1000; ++i) {
      robot.drive(filter, 0.02, i % 250 < 200);
      truth.emplace_back(at(robot.seconds), robot.truth);
      filtered2 += off_m(filter, robot) * off_m(filter, robot);
    }
    std::size_t next = 0;
    for (const LocalizationEstimate& estimate : smooth(filter.tracker().trace())) {
      while (next < truth.size() && truth[next].first < estimate.stamp) ++next;
      if (next == truth.size() || truth[next].first != estimate.stamp) continue;
      smoothed2 += (estimate.map_T_base.translation() - truth[next].second.translation()).squaredNorm();
    }
  }
  EXPECT_LT(smoothed2, filtered2);
}

/// While the robot drives, the smoother says of each moment what it would say if the run ended a lag later;
/// and with a long lag, what it says in the end.
TEST(Smoother, WithALagSaysWhatItWouldSayInTheEnd) {
  RiekfOptions options;
  options.tag_sigma_m = 0.01;
  options.lag_s = 0.5;
  FixedLagSmoother live(Landmarks::of_points(points()).value(), {}, options);
  RiekfLocalizer whole(Landmarks::of_points(points()).value(), {}, options);
  whole.tracker().keep_trace();
  Robot robot;
  Robot twin;
  const auto in_hindsight = [&] {
    for (const LocalizationEstimate& e : smooth(whole.tracker().trace()))
      if (e.stamp >= whole.tracker().trace().back().stamp - Duration(std::llround(options.lag_s * 1e9)))
        return e;
    return LocalizationEstimate{};
  };
  robot.drive(*live.filter(), 0.4);
  twin.drive(whole, 0.4);
  EXPECT_FALSE(live.estimate()) << "nothing is settled before the lag has passed";
  for (int i = 0; i < 200; ++i) {
    robot.drive(*live.filter(), 0.1);
    twin.drive(whole, 0.1);
    if (i < 10 || i % 20 != 0) continue;
    const auto settled = live.estimate();
    ASSERT_TRUE(settled);
    const LocalizationEstimate expected = in_hindsight();
    EXPECT_EQ(settled->stamp, expected.stamp);
    EXPECT_LT(minus(settled->map_T_base, expected.map_T_base).norm(), 1e-12);
    EXPECT_LT((settled->covariance - expected.covariance).norm(), 1e-12);
    EXPECT_LT(settled->covariance.trace(), whole.estimate()->covariance.trace());
  }
}

}  // namespace
}  // namespace waymark
