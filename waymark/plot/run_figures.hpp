#pragma once

#include <string>
#include <vector>

#include "waymark/plot/figure.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/trajectory.hpp"

/// Figures for a lap that was taught, mapped and repeated.
namespace waymark::plot {

/// One colour per source, the same in every figure and report. The viewer uses the same colours on its light
/// page (--truth, --odometry, --estimate in viewer/src/style.css; a test compares them).
inline constexpr Color kTruthColor = kPalette[2];            // green
inline constexpr Color kOdometryColor = kPalette[0];         // blue
inline constexpr Color kEstimateColor{0.757, 0.071, 0.122};  // red
inline constexpr Color kTaughtColor = kOdometryColor;        // for figures without odometry

/// A path on the floor and the tags that belong to it; either may be empty.
struct PathLayer {
  std::string name;
  Trajectory path{};
  TagMap tags{};
  Color color{};
};

/// A map seen from above with equal scales in x and y. Each tag is a short line with a stroke towards its
/// viewer, labelled once with its id. The layers are drawn in order, each narrower and with longer dashes
/// than the one below it, so that layers remain visible where they coincide.
[[nodiscard]] Figure path_figure(const std::string& title, const std::vector<PathLayer>& layers);

/// Distance between the estimated and the true base position at the same time, plotted against the true
/// distance driven.
[[nodiscard]] Figure trajectory_error_figure(const std::string& title, const Trajectory& estimated,
                                             const Trajectory& truth);

/// Distance from a driven path to the nearest point on the taught path, plotted against the distance driven.
[[nodiscard]] Figure cross_track_figure(const std::string& title, const Trajectory& driven,
                                        const Trajectory& taught);

/// Number of tags in each frame, plotted over time.
[[nodiscard]] Figure tags_in_view_figure(const std::string& title, const std::vector<TagFrame>& frames);

// Figures of one drive over time. The time axis starts at the beginning of the drive.

/// Speed and yaw rate measured by wheel odometry.
[[nodiscard]] Figure speed_figure(const std::string& title, const std::vector<Odometry>& odometry);

/// Position error of the estimate, and twice its standard deviation in the worst floor-plane direction. If
/// the truth is not available, only the standard deviation is shown.
[[nodiscard]] Figure error_and_uncertainty_figure(const std::string& title,
                                                  const EstimatedTrajectory& estimate,
                                                  const Trajectory& truth);

/// Heading of the estimate minus true heading [deg].
[[nodiscard]] Figure heading_error_figure(const std::string& title, const EstimatedTrajectory& estimate,
                                          const Trajectory& truth);

}  // namespace waymark::plot
