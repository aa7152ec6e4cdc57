#include "waymark/evaluation/replay_judgement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/evaluation/driven_path.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using internal::driven_path;
using internal::nearest_foot;
using internal::PathFoot;
using internal::PathPose;

constexpr double kStepMetres = 0.01;
constexpr double kShortestMetres = 0.5;
constexpr double kWindowMetres = 0.5;  // maximum motion of the foot point between consecutive poses
constexpr double kLapToleranceMetres = 0.25;

/// The foot point near an arc length on a closed lap, considering all passes of the teach lap.
std::optional<PathFoot> foot_near(const std::vector<PathPose>& taught, const PathPose& at, double arc_m,
                                  const std::optional<double>& lap_m) {
  std::optional<PathFoot> nearest;
  for (const double pass : {-1.0, 0.0, 1.0}) {
    if (pass != 0.0 && !lap_m) continue;
    const double center = arc_m + pass * lap_m.value_or(0);
    const auto foot = nearest_foot(taught, at, center - kWindowMetres, center + kWindowMetres);
    if (foot && (!nearest || foot->distance_m < nearest->distance_m)) nearest = foot;
  }
  return nearest;
}

/// The positions of a replay projected onto the taught path, in order, with the distance along the path.
struct Feet {
  std::vector<PathFoot> feet;
  double progress_m = 0;
};

Feet follow(const std::vector<PathPose>& replayed, const std::vector<PathPose>& taught,
            const std::optional<double>& lap_m) {
  Feet result;
  for (const PathPose& at : replayed) {
    std::optional<PathFoot> foot;
    if (!result.feet.empty()) foot = foot_near(taught, at, result.feet.back().arc_length_m, lap_m);
    if (!foot) foot = nearest_foot(taught, at);
    for (const bool backwards : {at.backwards, !at.backwards}) {
      if (foot) break;
      PathPose either = at;
      either.backwards = backwards;
      foot = nearest_foot(taught, either, 0, std::numeric_limits<double>::infinity());
    }
    if (!result.feet.empty()) {
      const double moved = foot->arc_length_m - result.feet.back().arc_length_m;
      result.progress_m += lap_m ? std::remainder(moved, *lap_m) : moved;
    }
    result.feet.push_back(*foot);
  }
  return result;
}

double least_clearance_m(const Trajectory& replayed, const std::vector<PathPose>& path, const TagMap& tags,
                         const Hull& hull) {
  double least = std::numeric_limits<double>::infinity();
  for (const PathPose& at : path)
    least = std::min(least, clearance_m(hull, replayed[at.pose].map_T_base, tags));
  return least;
}

Status long_enough(const std::vector<PathPose>& path, const char* name) {
  const double length_m = path.empty() ? 0 : path.back().arc_length_m;
  if (length_m >= kShortestMetres) return {};
  return fail(ErrorCode::InvalidArgument,
              fmt::format("the {} of {:.2f} m is too short to be evaluated", name, length_m), {},
              "Drive at least 0.5 m.");
}

void score_feet(const std::vector<PathPose>& replay, const std::vector<PathFoot>& feet,
                ReplayJudgement& judgement) {
  std::vector<double> distances;
  double squared_m2 = 0;
  double squared_rad2 = 0;
  for (std::size_t i = 0; i < feet.size(); ++i) {
    const double turned = std::remainder(replay[i].yaw_rad - feet[i].yaw_rad, 2 * std::numbers::pi);
    distances.push_back(feet[i].distance_m);
    squared_m2 += feet[i].distance_m * feet[i].distance_m;
    squared_rad2 += turned * turned;
  }
  const auto count = static_cast<double>(distances.size());
  std::ranges::sort(distances);
  judgement.cross_track_rmse_m = std::sqrt(squared_m2 / count);
  judgement.cross_track_p95_m = distances[(distances.size() - 1) * 95 / 100];
  judgement.cross_track_max_m = distances.back();
  judgement.heading_rmse_deg = to_degrees(std::sqrt(squared_rad2 / count));
}

}  // namespace

Result<ReplayJudgement> judge_replay(const Trajectory& replayed, const Trajectory& taught,
                                     const TagMap& true_tags, const Hull& hull) {
  const std::vector<PathPose> replay = driven_path(replayed, kStepMetres);
  const std::vector<PathPose> teach = driven_path(taught, kStepMetres);
  if (Status status = long_enough(teach, "teach lap"); !status) return tl::unexpected(status.error());
  if (Status status = long_enough(replay, "replay"); !status) return tl::unexpected(status.error());
  ReplayJudgement judgement{.distance_m = replay.back().arc_length_m, .lap_m = internal::lap_length_m(teach)};
  const Feet feet = follow(replay, teach, judgement.lap_m);
  score_feet(replay, feet.feet, judgement);
  judgement.min_clearance_m = least_clearance_m(replayed, replay, true_tags, hull);
  judgement.progress_m = feet.progress_m;
  const double length_m = judgement.lap_m.value_or(teach.back().arc_length_m);
  judgement.laps = judgement.progress_m / length_m;
  judgement.laps_completed =
      static_cast<int>(std::floor(std::max(0.0, judgement.progress_m + kLapToleranceMetres) / length_m));
  return judgement;
}

}  // namespace waymark
