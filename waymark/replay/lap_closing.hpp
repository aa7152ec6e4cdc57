#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

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
