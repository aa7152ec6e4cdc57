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

/// A lap usually goes on beyond its start, by less than this. What repeats a loop for longer is reported.
inline constexpr double kUsualOverlap_m = 1.5;

/// When a driven line is back at its start, and when what follows repeats it: within this distance and this
/// angle between the directions driven, but for departures that are shorter than the distance.
struct LapClosing {
  double distance_m = 0.5;
  double angle_rad = 0.8;
};

/// Points at even arc length.
struct EvenLine {
  std::vector<Eigen::Vector2d> points{};
  std::vector<std::size_t> sources{};  ///< per point, the index of the given point that it lies before or at
};

/// Jitter shorter than a step is not distance driven: a point counts once it is a step away. O(points +
/// steps).
[[nodiscard]] EvenLine even_steps(const std::vector<Eigen::Vector2d>& points, double step_m);

/// The number of points of an even line up to its first return to the start whose rest repeats what lies
/// before it: one loop of a lap that was driven several times, or that goes on beyond its start. A return
/// whose rest leads elsewhere, as in a figure eight, is part of the loop. Nothing: the line is open. O(points
/// * distance_m / step_m) per return.
[[nodiscard]] std::optional<std::size_t> points_of_first_loop(const std::vector<Eigen::Vector2d>& even,
                                                              double step_m, const LapClosing& closing);

}  // namespace waymark

namespace waymark::internal {

using Line = std::vector<Eigen::Vector2d>;

/// Points at even steps, smoothed: minimises the squared distance from them plus that of the third derivative
/// (smoothing spline: Reinsch, "Smoothing by Spline Functions", Numerische Mathematik 10, 1967; Eilers and
/// Marx, "Flexible Smoothing with B-splines and Penalties", Statistical Science 11, 1996). Straight lines and
/// wide circles stay where they are: a wave of length L keeps 1 / (1 + (wave_m / L)^6) of its height. Where
/// the curvature would be more than `max_curvature_1_m` (0: any) the line is bent straighter there, and only
/// there. O(points).
[[nodiscard]] Line smooth_line(const Line& line, bool closed, double step_m, double wave_m,
                               double max_curvature_1_m);

/// Turn over way at every point of a line [1/m].
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
  double repeated_m = 0;  ///< driven beyond the closing point and cut off, because it repeats the route
};

/// The route a trajectory drove, on the floor: even steps of arc length, smoothed, closed where the lap came
/// back to its start and the rest repeats it (points_of_first_loop(); the rest is cut off). A rest that leads
/// elsewhere is part of the route. Where the robot reversed, the speed changes its sign; such a route stays
/// open. Standing still adds nothing. Fails on a trajectory shorter than half a metre. O(poses) per return to
/// the start.
[[nodiscard]] Result<BuiltRoute> build_route(const Trajectory& trajectory, const RouteOptions& options = {});

/// The longest way along a taught lap during which no frame held a tag of the map [m]. Frames and poses in
/// order of time; a pose has the stamp of its frame.
[[nodiscard]] double longest_without_tags_m(const Trajectory& lap, const std::vector<TagFrame>& frames,
                                            const TagMap& map);

/// The same of a route whose lap is not known, by which tags any of the cameras could see; occlusion is not
/// considered.
[[nodiscard]] double longest_without_tags_m(const Route& route, const TagMap& map,
                                            const std::vector<MountedCamera>& cameras);

}  // namespace waymark
