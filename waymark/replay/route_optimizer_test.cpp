// Tests that the optimised route stays within its corridor and the curvature limit, and is as fast as the
// result of a much denser search. It must be no worse than the taught route in clearance or visibility.
#include "waymark/replay/route_optimizer.hpp"

#include <cmath>
#include <cstdlib>
#include <numbers>

#include <gtest/gtest.h>

namespace waymark {
namespace {

/// An oval made of straights and tight bends, with a wiggle and points every 5 cm.
Route oval() {
  Route route{.closed = true};
  constexpr int kPoints = 240;
  std::vector<Eigen::Vector2d> line;
  for (int i = 0; i < kPoints; ++i) {
    const double t = 2 * std::numbers::pi * i / kPoints;
    line.emplace_back(2.4 * std::cos(t), (1.2 + 0.05 * std::cos(5 * t)) * std::sin(t));
  }
  double arc = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Eigen::Vector2d d = line[(i + 1) % line.size()] - line[(i + line.size() - 1) % line.size()];
    if (i > 0) arc += (line[i] - line[i - 1]).norm();
    route.points.push_back({.map_T_base = SE2(line[i].x(), line[i].y(), std::atan2(d.y(), d.x())),
                            .arc_length_m = arc,
                            .speed_m_s = 0.5});
  }
  route.length_m = arc + (line.front() - line.back()).norm();
  const std::size_t n = line.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d a = line[i] - line[(i + n - 1) % n];
    const Eigen::Vector2d b = line[(i + 1) % n] - line[i];
    const double turn = std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
    route.points[i].curvature_1_m = turn / ((a.norm() + b.norm()) / 2);
  }
  return route;
}

const RobotModel kRobot{.hull = {.front_m = 0.16, .rear_m = 0.16, .width_m = 0.22, .height_m = 0.25}};
const ProfileOptions kFast{.speed_m_s = 1.2, .acceleration_m_s2 = 0.8, .deceleration_m_s2 = 0.8};

TEST(RouteOptimizer, IsAsFastAsADenserSearchAndStaysInItsCorridor) {
  const TagMap none;
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value();
  const RouteScene scene{&none, &kRobot, &camera};
  OptimizerOptions options{.smoothness_weight = 0};
  const auto found = optimize_route(oval(), scene, kFast, options);
  ASSERT_TRUE(found);
  options.narrowest_m = 0.2;
  options.rounds = std::getenv("WAYMARK_FULL") != nullptr ? 200 : 20;
  const auto dense = optimize_route(oval(), scene, kFast, options);
  ASSERT_TRUE(dense);
  std::printf("lap taught %.3f s, optimised %.3f s, dense search %.3f s\n", found->taught.lap_s,
              found->optimized.lap_s, dense->optimized.lap_s);
  EXPECT_LT(found->optimized.lap_s, 0.95 * found->taught.lap_s);
  EXPECT_LT(found->optimized.lap_s, 1.03 * dense->optimized.lap_s);
  EXPECT_LE(found->optimized.largest_offset_m, options.corridor_m + 0.002);
  EXPECT_LE(found->optimized.max_curvature_1_m,
            std::max(options.max_curvature_1_m, found->taught.max_curvature_1_m));
}

// The optimum on a circle is known: the inner edge of the corridor at speed sqrt(a r).
TEST(RouteOptimizer, FindsTheInnerEdgeOfACircle) {
  Route circle{.closed = true};
  constexpr int kPoints = 200;
  for (int i = 0; i < kPoints; ++i) {
    const double t = 2 * std::numbers::pi * i / kPoints;
    circle.points.push_back(
        {.map_T_base = SE2(1.5 * std::cos(t), 1.5 * std::sin(t), t + std::numbers::pi / 2),
         .arc_length_m = 1.5 * t,
         .curvature_1_m = 1 / 1.5,
         .speed_m_s = 0.5});
  }
  circle.length_m = 3 * std::numbers::pi;
  const TagMap none;
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value();
  const auto found = optimize_route(circle, {&none, &kRobot, &camera}, {.speed_m_s = 3, .turning_rad_s = 5},
                                    {.smoothness_weight = 0});
  ASSERT_TRUE(found);
  const double best_s = 2 * std::numbers::pi * std::sqrt((1.5 - 0.15) / 0.6);
  std::printf("circle: %.3f s, best %.3f s\n", found->optimized.lap_s, best_s);
  EXPECT_LT(found->optimized.lap_s, 1.03 * best_s);
  EXPECT_GT(found->optimized.lap_s, 0.995 * best_s);
}

TEST(RouteOptimizer, RejectsRoutesThatReverse) {
  Route route = oval();
  route.points[3].speed_m_s = -0.3;
  const TagMap none;
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value();
  EXPECT_FALSE(optimize_route(route, {&none, &kRobot, &camera}, kFast, {}));
}

}  // namespace
}  // namespace waymark
