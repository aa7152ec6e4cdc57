#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/route.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// A lap usually continues past its start by less than this distance. A longer repeated part is reported.
inline constexpr double kUsualOverlap_m = 1.5;

/// Thresholds for detecting that a driven line has returned to its start and that what follows repeats the
/// line: a distance, and an angle between the driving directions. Deviations shorter than the distance are
/// tolerated.
struct LapClosing {
  double distance_m = 0.5;
  double angle_rad = 0.8;
};

/// Evenly spaced points.
struct EvenLine {
  std::vector<Eigen::Vector2d> points{};
  std::vector<std::size_t> sources{};  ///< for each point, the index of the last input point before it
};

/// Resamples a line at equal spacing. Jitter smaller than one step does not add distance, because a point
/// counts only once it is one step away. O(points + steps).
[[nodiscard]] EvenLine even_steps(const std::vector<Eigen::Vector2d>& points, double step_m);

/// Number of points in one loop, if a lap was driven several times or continues past its start. The loop ends
/// when the evenly spaced line first returns to its start in such a way that everything after that repeats
/// the line. A return after which the line leads elsewhere, as in a figure eight, is part of the loop.
/// `nullopt` if the line is open. O(points * distance_m / step_m) per return.
[[nodiscard]] std::optional<std::size_t> points_of_first_loop(const std::vector<Eigen::Vector2d>& even,
                                                              double step_m, const LapClosing& closing);

}  // namespace waymark

namespace waymark::internal {

using Line = std::vector<Eigen::Vector2d>;

/// Smooths evenly spaced points by minimising the squared distance from them plus the squared third
/// derivative (smoothing spline: Reinsch, "Smoothing by Spline Functions", Numerische Mathematik 10, 1967;
/// Eilers and Marx, "Flexible Smoothing with B-splines and Penalties", Statistical Science 11, 1996).
/// Straight lines and wide circles are preserved: a wave of length L keeps 1 / (1 + (wave_m / L)^6) of its
/// amplitude. Where the curvature would exceed `max_curvature_1_m`, the line is straightened locally; 0 means
/// no limit. O(points).
[[nodiscard]] Line smooth_line(const Line& line, bool closed, double step_m, double wave_m,
                               double max_curvature_1_m);

/// Curvature (turn per distance) at every point on a line [1/m].
[[nodiscard]] std::vector<double> curvatures(const Line& line, bool closed);

}  // namespace waymark::internal

namespace waymark {

struct RouteOptions {
  double step_m = 0.05;
  double smoothing_m = 0.6;
  double max_curvature_1_m = 4;
  double speed_m_s = 0.3;
  double closing_distance_m = 0.5;
  double closing_angle_rad = 0.8;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.step_m, Field{"step_m", "Spacing of the route points.", 0.005, 1});
    visit(self.smoothing_m,
          Field{"smoothing_m",
                "Length of the smoothing window; longer removes more driving noise and cuts corners.", 0, 5});
    visit(self.max_curvature_1_m,
          Field{"max_curvature_1_m", "Maximum curvature of the route (1 / radius); 0: as driven.", 0, 1000});
    visit(self.speed_m_s, Field{"speed_m_s", "Reference speed of the whole route.", 0.01, 5});
    visit(self.closing_distance_m,
          Field{"closing_distance_m",
                "Distance between start and end of a lap below which the route is closed.", 0, 10});
    visit(self.closing_angle_rad,
          Field{"closing_angle_rad",
                "Angle between the headings at start and end below which the route is closed.", 0, 3.2});
  }
};

struct BuiltRoute : Route {
  double repeated_m = 0;  ///< length of the repeated part that was cut off after the closing point
};

/// Builds a route from a trajectory driven on the floor, with smoothed, evenly spaced points. The route is
/// closed if the lap returned to its start and everything after that repeats it (points_of_first_loop()); the
/// repeated part is cut off. If the rest leads elsewhere, it becomes part of the route. At points where the
/// robot reversed, the speed changes sign; such a route is open. Points keep the taught heading: its angle to
/// the direction of motion is averaged over half a metre (route_checks.hpp refuses large ones). Standstills
/// and turns on the spot add no points. Fails if the trajectory is shorter than 0.5 m. O(poses) per return to
/// the start.
[[nodiscard]] Result<BuiltRoute> build_route(const Trajectory& trajectory, const RouteOptions& options = {});

/// The longest distance along a taught lap without a frame that contains a map tag [m]. Frames and poses must
/// be in time order; each pose has the timestamp of its frame.
[[nodiscard]] double longest_without_tags_m(const Trajectory& lap, const std::vector<TagFrame>& frames,
                                            const TagMap& map);

/// The same for a route without its lap, based on which tags are visible to any of the cameras; occlusion is
/// not taken into account.
[[nodiscard]] double longest_without_tags_m(const Route& route, const TagMap& map,
                                            const std::vector<MountedCamera>& cameras);

}  // namespace waymark
