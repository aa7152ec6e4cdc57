// The follower on a robot that is nothing but a unicycle with motors: where the errors go, whatever the yaw
// gain, forwards and backwards, round a loop and to an end.
#include "waymark/replay/path_follower.hpp"

#include <cmath>
#include <deque>
#include <numbers>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/replay/speed_profile.hpp"

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr Duration kTick = std::chrono::milliseconds(10);

/// A figure of eight, a circle (closed), or a line (open) with points every 5 cm.
Route route_of(const std::string& shape, double speed_m_s) {
  Route route{.closed = shape != "line"};
  const int count = shape == "eight" ? 300 : 200;
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  for (int i = 0; i < count; ++i) {
    const double t = 2 * kPi * i / count;
    Eigen::Vector2d p(2 * std::cos(t), 2 * std::sin(t));
    Eigen::Vector2d ahead(-std::sin(t), std::cos(t));
    double curvature = 0.5;
    if (shape == "line") {
      p = {0.05 * i, 0};
      ahead = {1, 0};
      curvature = 0;
    } else if (shape == "eight") {
      p = {2 * std::sin(t), 1.5 * std::sin(2 * t)};
      ahead = {2 * std::cos(t), 3 * std::cos(2 * t)};
      const Eigen::Vector2d bend(-2 * std::sin(t), -6 * std::sin(2 * t));
      curvature = (ahead.x() * bend.y() - ahead.y() * bend.x()) / std::pow(ahead.norm(), 3);
    }
    const double arc = i == 0 ? 0 : route.points.back().arc_length_m + (p - before).norm();
    const double yaw = std::atan2(ahead.y(), ahead.x()) + (speed_m_s < 0 ? kPi : 0);
    route.points.push_back({SE2(p.x(), p.y(), yaw), arc, curvature, speed_m_s});
    before = p;
  }
  route.length_m = route.points.back().arc_length_m +
                   (route.closed ? (route.points[0].map_T_base.translation() - before).norm() : 0);
  return with_speed_profile(route, {});
}

struct Plant {
  SE2 map_T_base{};
  double yaw_gain = 1;
  double slip_s = -0.03;
  double centre_m = 0;
  double speed = 0;
  double yaw_rate = 0;
  void step(const VelocityCommand& command, double dt_s) {
    speed += (command.speed_m_s - speed) * (1 - std::exp(-dt_s / 0.12));
    yaw_rate += (command.yaw_rate_rad_s - yaw_rate) * (1 - std::exp(-dt_s / 0.10));
    const double turn = yaw_gain * yaw_rate;
    const double aside = slip_s * speed * turn - centre_m * turn;
    map_T_base = map_T_base * SE2::exp(Eigen::Vector3d(speed, aside, turn) * dt_s);
  }
};

struct Drive {
  double worst_m = 0;  ///< after the first metres
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

TEST(PathFollower, KeepsToACircleWithAnyYawGainAndLearnsIt) {
  for (const double gain : {0.6, 0.8, 1.0}) {
    const Drive run =
        drive(route_of("circle", 0.4), {.map_T_base = SE2(2.05, 0, kPi / 2 + 0.2), .yaw_gain = gain}, 26);
    EXPECT_LT(run.worst_m, 0.02) << gain;
    EXPECT_NEAR(run.turning.gain, gain, 0.02);
  }
}

TEST(PathFollower, CrossesAFigureOfEightWithoutAJump) {
  for (const double speed : {0.3, -0.3}) {
    const Route route = route_of("eight", speed);
    const Drive run =
        drive(route, {.map_T_base = route.points[0].map_T_base, .yaw_gain = 0.8}, 2 * route.length_m);
    EXPECT_GE(run.driven_m, 2 * route.length_m) << speed;
    EXPECT_LT(run.worst_m, 0.02) << speed;
    EXPECT_LT(run.worst_step_m, 0.05) << "at 0.3 m/s, twenty times a second";
  }
}

TEST(PathFollower, LearnsAboutWhichPointTheRobotTurns) {
  for (const double speed : {0.3, -0.3}) {
    for (const double centre_m : {0.04, -0.04}) {
      const Route route = route_of("eight", speed);
      const Drive run = drive(
          route,
          {.map_T_base = route.points[0].map_T_base, .yaw_gain = 0.6, .slip_s = 0, .centre_m = centre_m},
          2 * route.length_m, route.length_m);
      EXPECT_NEAR(run.turning.centre_m, centre_m, 0.005) << speed;
      EXPECT_LT(run.worst_m, 0.008) << speed << " m/s, " << centre_m << " m";
    }
  }
}

TEST(PathFollower, StopsAtTheGoalWithoutGoingBack) {
  Drive run = drive(route_of("line", 0.4), {.map_T_base = SE2(0, 0.2, -0.3)}, 100);
  EXPECT_NEAR(run.driven_m, 9.95, 0.02);
  EXPECT_LT(run.plant.speed, 0.1);
  EXPECT_LT(run.worst_m, 0.03);
}

TEST(SpeedProfile, NoPointIsFasterThanItsCurveAndNoStretchThanItsAcceleration) {
  const ProfileOptions options{.speed_m_s = 1.5};
  for (const char* shape : {"eight", "circle", "line"}) {
    const Route route = with_speed_profile(route_of(shape, 0.4), options);
    const std::size_t n = route.points.size();
    for (std::size_t i = 0; i < n; ++i) {
      const RoutePoint& a = route.points[i];
      const double v = a.speed_m_s;
      EXPECT_LE(v * v * std::abs(a.curvature_1_m), options.lateral_acceleration_m_s2 + 1e-9);
      EXPECT_LE(v * std::abs(a.curvature_1_m), options.turning_rad_s + 1e-9);
      if (i + 1 == n && !route.closed) continue;
      const RoutePoint& b = route.points[(i + 1) % n];
      const double way = i + 1 < n ? b.arc_length_m - a.arc_length_m : route.length_m - a.arc_length_m;
      const double gained = (b.speed_m_s * b.speed_m_s - v * v) / (2 * way);
      EXPECT_LE(gained, options.acceleration_m_s2 + 1e-9) << shape << i;
      EXPECT_GE(gained, -options.deceleration_m_s2 - 1e-9) << shape << i;
    }
  }
  EXPECT_NEAR(with_speed_profile(route_of("line", 0.4), options).points.back().speed_m_s, 0.05, 1e-12);
}

/// Not at the end of a route either, where it would crawl faster.
TEST(SpeedProfile, IsNeverFasterThanTheSpeedThatWasAskedFor) {
  const ProfileOptions options{.speed_m_s = 0.02};
  for (const char* shape : {"eight", "line"})
    for (const RoutePoint& point : with_speed_profile(route_of(shape, 0.4), options).points)
      EXPECT_LE(std::abs(point.speed_m_s), 0.02 + 1e-12) << shape;
}

}  // namespace
}  // namespace waymark
