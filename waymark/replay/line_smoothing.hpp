#pragma once

#include <vector>

#include <Eigen/Core>

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
