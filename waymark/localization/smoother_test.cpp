#include "waymark/localization/smoother.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/laser_robot.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/localization/riekf_localizer.hpp"

namespace waymark {
namespace {

using test::laser_points;
using test::laser_time;
using test::LaserRobot;
using test::off_m;

/// With lasting position errors of landmarks, smoothing must not increase the error.
TEST(Smoother, LastingLandmarkErrorsDoNotMakeTheSmootherWorse) {
  double filtered2 = 0;
  double smoothed2 = 0;
  for (int seed = 0; seed < 4; ++seed) {
    RiekfOptions options;
    options.tag_sigma_m = 0.05;
    options.tag_time_s = 1e4;
    std::vector<LandmarkPoint> mapped = laser_points();
    LaserRobot robot{.random = Random(static_cast<std::uint64_t>(20 + seed))};
    for (LandmarkPoint& point : mapped)
      point.map_p += 0.05 * Eigen::Vector2d(robot.random.normal(), robot.random.normal());
    RiekfLocalizer filter(Landmarks::of_points(mapped).value(), {}, options);
    filter.tracker().keep_trace();
    filter.start_from(robot.truth, 0.05, 0.05);
    std::vector<std::pair<SensorTime, SE2>> truth;
    for (int i = 0; i < 1000; ++i) {
      robot.drive(filter, 0.02, i % 250 < 200);
      truth.emplace_back(laser_time(robot.seconds), robot.truth);
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

/// The fixed-lag estimate for a given time equals the smoothed estimate from a run that ends one lag later.
/// With a long lag, it equals that from the whole run.
TEST(Smoother, FixedLagEqualsSmoothingOfARunThatEndsOneLagLater) {
  RiekfOptions options;
  options.tag_sigma_m = 0.01;
  options.lag_s = 0.5;
  FixedLagSmoother live(Landmarks::of_points(laser_points()).value(), {}, options);
  RiekfLocalizer whole(Landmarks::of_points(laser_points()).value(), {}, options);
  whole.tracker().keep_trace();
  LaserRobot robot;
  LaserRobot twin;
  const auto in_hindsight = [&] {
    for (const LocalizationEstimate& e : smooth(whole.tracker().trace()))
      if (e.stamp >= whole.tracker().trace().back().stamp - Duration(std::llround(options.lag_s * 1e9)))
        return e;
    return LocalizationEstimate{};
  };
  robot.drive(*live.filter(), 0.4);
  twin.drive(whole, 0.4);
  EXPECT_FALSE(live.estimate()) << "no estimate before the lag has passed";
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
