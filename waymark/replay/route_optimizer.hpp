#pragma once

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/replay/speed_profile.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/route.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

struct OptimizerOptions {
  double corridor_m = 0.15;
  double time_weight = 1;
  double smoothness_weight = 0.02;
  double clearance_weight = 0.1;
  double visibility_weight = 0.1;
  double wanted_clearance_m = 0.5;
  double wanted_tags = 2;
  double max_curvature_1_m = 2.5;
  double narrowest_m = 0.5;
  double rounds = 5;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.corridor_m,
          Field{"corridor_m", "Maximum distance of the route from the taught one.", 0.005, 5});
    visit(self.time_weight, Field{"time_weight", "Cost of a lap time of twice the taught one.", 0, 1e6});
    visit(self.smoothness_weight,
          Field{"smoothness_weight", "Cost of the mean squared rate of the curvature, m^4.", 0, 1e6});
    visit(self.clearance_weight,
          Field{"clearance_weight", "Cost of a tag that touches the hull along the whole route.", 0, 1e6});
    visit(self.visibility_weight,
          Field{"visibility_weight", "Cost of one missing tag in view along the whole route.", 0, 1e6});
    visit(self.wanted_clearance_m,
          Field{"wanted_clearance_m", "Distance from tags beyond which clearance has no cost.", 0.01, 10});
    visit(self.wanted_tags,
          Field{"wanted_tags", "Number of tags in view beyond which visibility has no cost.", 0, 20});
    visit(self.max_curvature_1_m, Field{"max_curvature_1_m", "Maximum curvature of the route.", 0.01, 1000});
    visit(self.narrowest_m,
          Field{"narrowest_m", "Half width of the narrowest deformation that is tried.", 0.1, 10});
    visit(self.rounds, Field{"rounds", "Maximum number of passes over all deformations.", 1, 1000});
  }
};

/// Quality measures of a route.
struct RouteFigures {
  double lap_s = 0;
  double length_m = 0;
  double max_curvature_1_m = 0;
  double smoothness_1_m4 = 0;  ///< mean squared derivative of the curvature with respect to distance
  double min_clearance_m = 0;  ///< minimum 3D distance from the hull to a tag
  double two_tags_fraction = 0;
  double mean_tags = 0;
  double largest_offset_m = 0;  ///< largest offset from the taught route
};

struct OptimizedRoute {
  Route route{};
  RouteFigures taught{};
  RouteFigures optimized{};
};

/// The tags, cameras and robot used to evaluate a route.
struct RouteScene {
  const TagMap* tags = nullptr;
  const RobotModel* robot = nullptr;
  const CameraModel* camera = nullptr;
};

[[nodiscard]] RouteFigures route_figures(const Route& route, const Route& taught, const RouteScene& scene,
                                         const ProfileOptions& profile);

/// Optimises the lateral offset from the taught route by pattern search (Kolda, Lewis and Torczon,
/// "Optimization by Direct Search", SIAM Review 45(3), 2003) over smooth bumps from wide to narrow. The cost
/// combines the lap time computed by with_speed_profile(), smoothness, clearance and visible tags. Offsets
/// are penalised if their clearance is below the minimum of the taught route, or if fewer than two tags are
/// visible where the taught route has two. If the result is worse in either respect, the taught route is
/// returned. Visible tags and clearance are tabulated on a grid of offsets, with the heading of the direction
/// of motion. Fails if the route changes direction or moves sideways (check_sideways()), or if an option is
/// out of range. O(points * (tags + rounds * length / narrowest)).
[[nodiscard]] Result<OptimizedRoute> optimize_route(const Route& taught, const RouteScene& scene,
                                                    const ProfileOptions& profile,
                                                    const OptimizerOptions& options);

}  // namespace waymark
