#pragma once

#include <string>
#include <vector>

#include "waymark/plot/figure.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/trajectory.hpp"

/// Figures of one drive over its time. The time axis begins with the drive.
namespace waymark::plot {

/// Speed and yaw rate as the wheels tell them.
[[nodiscard]] Figure speed_figure(const std::string& title, const std::vector<Odometry>& odometry);

/// How far the estimate is from the truth, and twice the standard deviation it claims along the worst
/// direction of the floor. The truth may be empty: then the doubt alone.
[[nodiscard]] Figure error_and_doubt_figure(const std::string& title, const EstimatedTrajectory& estimate,
                                            const Trajectory& truth);

/// Heading of the estimate less that of the truth [deg].
[[nodiscard]] Figure heading_error_figure(const std::string& title, const EstimatedTrajectory& estimate,
                                          const Trajectory& truth);

}  // namespace waymark::plot
