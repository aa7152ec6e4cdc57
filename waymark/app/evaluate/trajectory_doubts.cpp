#include "waymark/app/evaluate/trajectory_doubts.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/geometry/lie.hpp"
#include "waymark/recording/log_formats.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

std::vector<Odometry> odometry_of(const std::string& path, const JobControl& control) {
  std::vector<Odometry> all;
  if (!looks_like_recording(path)) return all;
  const auto log = open_log(path, control.log_options());
  if (!log) return all;
  const Status read = (*log)->visit_samples({.topics = {topics::kOdometry}}, [&](const Sample& sample) {
    if (const auto* odometry = std::get_if<Odometry>(&sample)) all.push_back(*odometry);
    return Status();
  });
  if (!read) all.clear();
  std::ranges::stable_sort(all, {}, &Odometry::stamp);
  return all;
}

/// The same moments, and the wheels say something else: what one drive cannot.
bool other_drive(const std::string& a, const std::string& b, const JobControl& control) {
  constexpr double kSame = 1e-3;
  const std::vector<Odometry> first = odometry_of(a, control);
  if (first.empty() || a == b) return false;
  std::size_t common = 0;
  std::size_t apart = 0;
  for (const Odometry& odometry : odometry_of(b, control)) {
    const auto at = std::ranges::lower_bound(first, odometry.stamp, {}, &Odometry::stamp);
    if (at == first.end() || at->stamp != odometry.stamp) continue;
    ++common;
    apart += minus(at->odom_T_base, odometry.odom_T_base).norm() > kSame ? 1U : 0U;
  }
  return 2 * apart > common;
}

/// How far the places of a reference are from their middle, root mean square [m].
double spread_of(const Reference& reference) {
  std::vector<Eigen::Vector2d> places = reference.path.corners;
  for (const StampedPose& pose : reference.timed)
    places.emplace_back(pose.map_T_base.translation().head<2>());
  if (places.empty()) return 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& place : places) mean += place;
  mean /= static_cast<double>(places.size());
  double squared = 0;
  for (const Eigen::Vector2d& place : places) squared += (place - mean).squaredNorm();
  return std::sqrt(squared / static_cast<double>(places.size()));
}

}  // namespace

std::vector<std::string> doubts_about(const TrajectoryReport& report, const Reference& reference,
                                      const JobControl& control) {
  std::vector<std::string> all;
  const TrajectoryRow& estimate = report.rows.front();
  if (estimate.scores && 2 * estimate.pairs < estimate.poses.size())
    all.push_back(
        fmt::format("only {} of {} poses of EST are at times that REF covers: are both of the same drive, on "
                    "the same clock?",
                    estimate.pairs, estimate.poses.size()));
  if (other_drive(report.estimate, report.reference, control))
    all.emplace_back(
        "EST and REF are of two drives: at the same times their odometry says something else. The figures "
        "say "
        "how far apart the drives were, not how good EST is");
  double rmse_m = 0;
  if (estimate.scores) {
    rmse_m = estimate.scores->ate_m.rmse;
  } else if (estimate.path) {
    rmse_m = estimate.path->distance_m.rmse;
  }
  constexpr double kLeast = 0.3;  // [m]
  constexpr double kShare = 0.7;
  if (report.alignment == AlignmentKind::None && rmse_m > std::max(kLeast, kShare * spread_of(reference)))
    all.push_back(
        fmt::format("EST is {:.1f} m from REF, as far as REF itself reaches: are both of the same place, in "
                    "the same map? --alignment se2 compares their shapes",
                    rmse_m));
  return all;
}

}  // namespace waymark
