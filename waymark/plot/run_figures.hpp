#pragma once

#include <string>
#include <vector>

#include "waymark/plot/figure.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

/// The figures of a loop that was taught, mapped and driven again.
namespace waymark::plot {

/// One colour a source, in every figure and report. The viewer uses the same on its light page
/// (--truth, --odometry, --estimate in viewer/src/style.css; a test compares them).
inline constexpr Color kTruthColor = kPalette[2];            // green
inline constexpr Color kOdometryColor = kPalette[0];         // blue
inline constexpr Color kEstimateColor{0.757, 0.071, 0.122};  // red
inline constexpr Color kTaughtColor = kOdometryColor;        // where no odometry is drawn

/// A way on the floor, and tags that belong to it; either may be empty.
struct PathLayer {
  std::string name;
  Trajectory path{};
  TagMap tags{};
  Color color{};
};

/// Seen from above, a metre as long in x as in y. Each tag is a short line with a stroke towards its reader,
/// and its id once. The layers are drawn in order, each narrower and with longer dashes than the one below
/// it, so that layers that coincide are all seen.
[[nodiscard]] Figure path_figure(const std::string& title, const std::vector<PathLayer>& layers);

/// Distance of the estimated base from the true one at the same time, over the way driven in truth.
[[nodiscard]] Figure trajectory_error_figure(const std::string& title, const Trajectory& estimated,
                                             const Trajectory& truth);

/// Distance of a driven way from the nearest point of the taught one, over the way driven.
[[nodiscard]] Figure cross_track_figure(const std::string& title, const Trajectory& driven,
                                        const Trajectory& taught);

/// How many tags each frame saw, over time.
[[nodiscard]] Figure tags_in_view_figure(const std::string& title, const std::vector<TagFrame>& frames);

// Figures of one drive over its time. The time axis begins with the drive.

/// Speed and yaw rate as the wheels tell them.
[[nodiscard]] Figure speed_figure(const std::string& title, const std::vector<Odometry>& odometry);

/// How far the estimate is from the truth, and twice the standard deviation it claims along the worst
/// direction of the floor. The truth may be empty: then the doubt alone.
[[nodiscard]] Figure error_and_uncertainty_figure(const std::string& title,
                                                  const EstimatedTrajectory& estimate,
                                                  const Trajectory& truth);

/// Heading of the estimate less that of the truth [deg].
[[nodiscard]] Figure heading_error_figure(const std::string& title, const EstimatedTrajectory& estimate,
                                          const Trajectory& truth);

}  // namespace waymark::plot
