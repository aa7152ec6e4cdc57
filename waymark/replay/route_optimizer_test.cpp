// The optimised route: in its corridor, no tighter than allowed, as fast as a much denser search finds, and
// nothing that matters is worse than on the taught one.
#include "waymark/replay/route_optimizer.hpp"

#include <cmath>
#include <cstdlib>
#include <numbers>

#include <gtest/gtest.h>

namespace waymark {
namespace {

/// An oval of straights and tight bends with a wiggle in it, every 5 cm.
Route oval() {
  Route route{.closed = true};
  constexpr int kPoints = 240;
  std::vector<Eigen::Vector2d> line;
  for (int i = 0; i < kPoints; ++i) {
    const double t = 2 * std::numbers::pi * i / kPoints;
    line.emplace_back(2.4 * std::cos(t), (1.2 + 0.12 * std::cos(5 * t)) * std::sin(t));
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
  options.knot_m = 0.12;
  options.rounds = std::getenv("WAYMARK_FULL") != nullptr ? 4000 : 300;
  const auto dense = optimize_route(oval(), scene, kFast, options);
  ASSERT_TRUE(dense);
  std::printf("lap taught %.3f s, optimised %.3f s, dense search %.3f s\n", found->taught.lap_s,
              found->optimized.lap_s, dense->optimized.lap_s);
  EXPECT_LT(found->optimized.lap_s, 0.95 * found->taught.lap_s);
  EXPECT_LT(found->optimized.lap_s, 1.03 * dense->optimized.lap_s);
  EXPECT_LE(found->optimized.largest_offset_m, options.corridor_m + 0.002);
  EXPECT_LE(found->optimized.max_curvature_1_m, options.max_curvature_1_m);
}

TEST(RouteOptimizer, ReversingRoutesAreRefused) {
  Route route = oval();
  route.points[3].speed_m_s = -0.3;
  const TagMap none;
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value();
  EXPECT_FALSE(optimize_route(route, {&none, &kRobot, &camera}, kFast, {}));
}

}  // namespace
}  // namespace waymark
