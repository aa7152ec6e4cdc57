#include "waymark/mapping/lap/loop_closure.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "waymark/geometry/planar.hpp"
#include "waymark/mapping/lap/odometry_track.hpp"
#include "waymark/mapping/lap/tag_votes.hpp"

namespace waymark {
namespace {

/// A frame that saw a tag, and where the map has the base then.
struct Visit {
  const TagDetection* seen = nullptr;
  const TagFrame* frame = nullptr;
  const StampedPose* base = nullptr;
};
using Visits = std::map<TagId, std::vector<Visit>>;

/// The observations in use of each tag of the map, in time.
Visits visits_of(const LapInput& lap, const BundleMap& map) {
  std::set<std::pair<SensorTime, TagId>> rejected;
  for (const RejectedObservation& observation : map.rejected)
    rejected.insert({observation.stamp, observation.tag});
  Visits visits;
  for (const TagFrame& frame : lap.frames) {
    const auto base = std::ranges::lower_bound(map.trajectory, frame.stamp, {}, &StampedPose::stamp);
    if (base == map.trajectory.end() || base->stamp != frame.stamp) continue;
    for (const TagDetection& seen : frame.detections) {
      if (map.map.find(seen.tag) != nullptr && !rejected.contains({frame.stamp, seen.tag}))
        visits[seen.tag].push_back({&seen, &frame, &*base});
    }
  }
  return visits;
}

/// Where the observations of a tag put it, from where the map has the base.
std::optional<SE3> place_by(const LapInput& lap, std::vector<Visit>::const_iterator first,
                            std::vector<Visit>::const_iterator last) {
  std::vector<internal::Vote<SE3>> votes;
  for (auto visit = first; visit != last; ++visit)
    votes.push_back(
        internal::vote_for_place(*visit->seen, visit->frame->camera, lap, visit->base->map_T_base));
  const auto agreed = internal::agree(votes, internal::kPoseGate);
  return agreed ? std::optional(agreed->value.mean) : std::nullopt;
}

double way_between(const Trajectory& trajectory, const StampedPose* from, const StampedPose* to) {
  double metres = 0;
  for (const StampedPose& pose : trajectory) {
    if (pose.stamp <= from->stamp || pose.stamp > to->stamp) continue;
    metres += (pose.map_T_base.translation() - (&pose - 1)->map_T_base.translation()).norm();
  }
  return metres;
}

/// The two observations between which a tag was out of sight for longest.
struct Gap {
  const std::vector<Visit>* of_tag = nullptr;
  std::size_t after = 0;  ///< the first observation once it is back
  double away_s = 0;
};

Gap longest_gap(const Visits& visits) {
  Gap longest;
  for (const auto& [tag, of_tag] : visits) {
    for (std::size_t i = 1; i < of_tag.size(); ++i) {
      const double away_s = to_seconds(of_tag[i].base->stamp - of_tag[i - 1].base->stamp);
      if (away_s > longest.away_s) longest = {&of_tag, i, away_s};
    }
  }
  return longest;
}

}  // namespace

std::optional<LoopClosure> loop_closure(const LapInput& lap, const BundleMap& map) {
  constexpr double kLeast_s = 10;
  const Visits visits = visits_of(lap, map);
  const Gap gap = longest_gap(visits);
  if (gap.away_s < kLeast_s) return std::nullopt;
  const auto back = gap.of_tag->begin() + static_cast<std::ptrdiff_t>(gap.after);
  const StampedPose* left = std::prev(back)->base;
  const StampedPose* returned = back->base;
  const OdometryTrack track(lap.odometry);
  const auto odom_from = track.at(left->stamp);
  const auto odom_to = track.at(returned->stamp);
  const auto first = place_by(lap, gap.of_tag->begin(), back);
  const auto again = place_by(lap, back, gap.of_tag->end());
  if (!odom_from || !odom_to || !first || !again) return std::nullopt;
  const SE2 by_map = project_to_plane(left->map_T_base.inverse() * returned->map_T_base);
  const SE2 off = by_map.inverse() * (odom_from->inverse() * *odom_to);
  return LoopClosure{.tag = back->seen->tag,
                     .away_s = gap.away_s,
                     .way_m = way_between(map.trajectory, left, returned),
                     .before_m = off.translation().norm(),
                     .before_rad = std::abs(off.yaw()),
                     .after_m = (first->translation() - again->translation()).norm()};
}

}  // namespace waymark
