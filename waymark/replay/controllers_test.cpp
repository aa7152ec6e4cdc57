// Tests the path follower on a simulated unicycle with motor lag. Its errors converge for any turn gain, both
// forwards and backwards, on closed and open routes.
#include "waymark/replay/controllers.hpp"

#include <cmath>
#include <deque>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/route_shapes.hpp"
#include "waymark/replay/route_builder.hpp"

namespace waymark {
namespace {

using test::circle_lap;
using test::shaped_route;

constexpr double kPi = std::numbers::pi;
constexpr Duration kTick = std::chrono::milliseconds(10);

struct Plant {
  SE2 map_T_base{};
  double turn_gain = 1;
  double slip_s = -0.03;
  double centre_m = 0;
  double speed = 0;
  double yaw_rate = 0;
  void step(const VelocityCommand& command, double dt_s) {
    speed += (command.speed_m_s - speed) * (1 - std::exp(-dt_s / 0.12));
    yaw_rate += (command.yaw_rate_rad_s - yaw_rate) * (1 - std::exp(-dt_s / 0.10));
    const double turn = turn_gain * yaw_rate;
    const double aside = slip_s * speed * turn - centre_m * turn;
    map_T_base = map_T_base * SE2::exp(Eigen::Vector3d(speed, aside, turn) * dt_s);
  }
};

struct Drive {
  double worst_m = 0;  ///< after the first few metres
  double worst_step_m = 0;
  double driven_m = 0;
  LearntTurning turning{};
  Plant plant{};
};

Drive drive(const Route& route, Plant plant, double way_m, double first_m = 2) {
  MotionPredictor predictor({});
  PathFollower follower({});
  RouteProgress progress = locate(route, plant.map_T_base);
  std::deque<StampedCommand> pending;
  VelocityCommand acting{};
  Drive run;
  SensorTime now{};
  for (int tick = 0; tick < 20000 && run.driven_m < way_m; ++tick, now += kTick) {
    if (tick % 5 == 0) {
      predictor.observe(now, plant.map_T_base, true);
      const RouteProgress before = progress;
      progress = advance(route, plant.map_T_base, progress);
      double moved = progress.arc_length_m - before.arc_length_m;
      if (route.closed) moved = std::remainder(moved, route.length_m);
      run.worst_step_m = std::max(run.worst_step_m, std::abs(moved));
      run.driven_m += moved;
      follower.integrate(progress, moved);
      if (run.driven_m > first_m) run.worst_m = std::max(run.worst_m, std::abs(progress.cross_track_m));
      if (!route.closed && progress.arc_length_m > route.length_m - 0.01) break;
      const PredictedMotion then = predictor.predict(predictor.acts_at(now));
      const RouteProgress at = advance(route, then.map_T_base, progress);
      const double left = route.closed ? 100 : route.length_m - at.arc_length_m;
      const VelocityCommand command = follower.follow(route, then, at, left, {}, predictor.turning());
      predictor.sent(now, command);
      pending.push_back({now, command});
    }
    while (!pending.empty() && pending.front().stamp + std::chrono::milliseconds(40) <= now) {
      acting = pending.front().command;
      pending.pop_front();
    }
    plant.step(acting, to_seconds(kTick));
  }
  run.turning = predictor.turning();
  run.plant = plant;
  return run;
}

TEST(PathFollower, FollowsACircleAndLearnsTheTurnGain) {
  for (const double gain : {0.6, 0.8, 1.0}) {
    const Drive run = drive(shaped_route("circle", 0.4),
                            {.map_T_base = SE2(2.05, 0, kPi / 2 + 0.2), .turn_gain = gain}, 26);
    EXPECT_LT(run.worst_m, 0.02) << gain;
    EXPECT_NEAR(run.turning.gain, gain, 0.02);
  }
}

TEST(PathFollower, CrossesAFigureOfEightWithoutAJump) {
  for (const double speed : {0.3, -0.3}) {
    const Route route = shaped_route("eight", speed);
    const Drive run =
        drive(route, {.map_T_base = route.points[0].map_T_base, .turn_gain = 0.8}, 2 * route.length_m);
    EXPECT_GE(run.driven_m, 2 * route.length_m) << speed;
    EXPECT_LT(run.worst_m, 0.02) << speed;
    EXPECT_LT(run.worst_step_m, 0.05) << "per step at 0.3 m/s and 20 Hz";
  }
}

TEST(PathFollower, LearnsTheCentreOfRotation) {
  for (const double speed : {0.3, -0.3}) {
    for (const double centre_m : {0.04, -0.04}) {
      const Route route = shaped_route("eight", speed);
      const Drive run = drive(
          route,
          {.map_T_base = route.points[0].map_T_base, .turn_gain = 0.6, .slip_s = 0, .centre_m = centre_m},
          2 * route.length_m, route.length_m);
      EXPECT_NEAR(run.turning.centre_m, centre_m, 0.005) << speed;
      EXPECT_LT(run.worst_m, 0.008) << speed << " m/s, " << centre_m << " m";
    }
  }
}

TEST(PathFollower, StopsAtTheGoalWithoutReversing) {
  Drive run = drive(shaped_route("line", 0.4), {.map_T_base = SE2(0, 0.2, -0.3)}, 100);
  EXPECT_NEAR(run.driven_m, 9.95, 0.02);
  EXPECT_LT(run.plant.speed, 0.1);
  EXPECT_LT(run.worst_m, 0.03);
}

TEST(PurePursuit, SteersTowardsTheRoute) {
  const auto route = build_route(circle_lap(0, 1.05));
  const auto command = [&](const SE2& pose) { return pure_pursuit(*route, pose, locate(*route, pose)); };
  EXPECT_NEAR(command(SE2(2, 0, std::numbers::pi / 2)).yaw_rate_rad_s, 0.3 * 0.5, 0.01)
      << "on the circle, the curvature of the circle";
  EXPECT_LT(command(SE2(1.9, 0, std::numbers::pi / 2)).yaw_rate_rad_s, 0.0)
      << "inside the circle, steer right";
  EXPECT_GT(command(SE2(2.1, 0, std::numbers::pi / 2)).yaw_rate_rad_s, 0.3)
      << "outside the circle, steer left";
}

}  // namespace
}  // namespace waymark
