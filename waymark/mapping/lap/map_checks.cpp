#include "waymark/mapping/lap/map_checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/angles.hpp"
#include "waymark/geometry/dense.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/lap/motion_tracks.hpp"
#include "waymark/pose/agreement.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

using internal::Vote;

constexpr int kMaxFewObservations = 3;
constexpr double kWeakSigma = 0.05;
/// A tag that is pushed or remounted is rarely displaced by more than this.
constexpr double kMaxPushed_m = 1.0;

const SE3* base_at(const BundleMap& map, SensorTime stamp) {
  const auto at = std::ranges::lower_bound(map.trajectory, stamp, {}, &StampedPose::stamp);
  return at != map.trajectory.end() && at->stamp == stamp ? &at->map_T_base : nullptr;
}

/// The tag poses according to one observation.
struct Observation {
  SensorTime stamp{};
  Vote<SE3> vote{};
};

bool shows(const Observation& observation, const SE3& map_T_tag) {
  return internal::nearest(observation.vote, map_T_tag, internal::kPoseGate).first != nullptr;
}

/// Calls `visit` with each observation of a tag in a frame with a pose, if `wants` its stamp.
template <class Wants, class Visit>
void for_observations(const TagId& tag, const LapInput& lap, const BundleMap& map, const Wants& wants,
                      const Visit& visit) {
  for (const TagFrame& frame : lap.frames) {
    for (const TagDetection& detection : frame.detections) {
      if (detection.tag != tag || !wants(frame.stamp)) continue;
      const SE3* map_T_base = base_at(map, frame.stamp);
      if (map_T_base == nullptr) continue;
      const Observation observation{frame.stamp,
                                    internal::vote_for_place(detection, frame.camera, lap, *map_T_base)};
      if (!observation.vote.empty()) visit(observation);
    }
  }
}

/// The rejected observations of a tag that are inconsistent with its pose in the map.
std::vector<Observation> observations_elsewhere(const TagId& tag, const MappedTag& mapped,
                                                const std::set<SensorTime>& rejected, const LapInput& lap,
                                                const BundleMap& map) {
  std::vector<Observation> elsewhere;
  for_observations(
      tag, lap, map, [&](SensorTime stamp) { return rejected.contains(stamp); },
      [&](const Observation& observation) {
        if (!shows(observation, mapped.map_T_tag)) elsewhere.push_back(observation);
      });
  return elsewhere;
}

bool seen_twice_at_once(const TagId& tag, const LapInput& lap) {
  int frames = 0;
  for (const TagFrame& frame : lap.frames)
    frames += std::ranges::count(frame.detections, tag, &TagDetection::tag) > 1 ? 1 : 0;
  return frames >= 2;
}

/// The point in time that separates the observations in two places, except for a few.
struct TimeOrder {
  bool apart = false;          ///< whether there is such a point
  bool here_is_later = false;  ///< whether the observations `here` are after it
  SensorTime last_before{};    ///< of those before it, disregarding exceptions
  SensorTime first_after{};    ///< of those after it
};

TimeOrder time_order(const std::vector<SensorTime>& here, const std::vector<SensorTime>& there) {
  constexpr double kMaxExceptionShare = 0.2;
  std::vector<std::pair<SensorTime, int>> both;
  both.reserve(here.size() + there.size());
  for (const SensorTime stamp : here) both.emplace_back(stamp, 1);
  for (const SensorTime stamp : there) both.emplace_back(stamp, -1);
  std::ranges::sort(both);
  const auto all_here = static_cast<int>(here.size());
  const auto all_there = static_cast<int>(there.size());
  int fewest = std::min(all_here, all_there);
  int before = 0;  // number of `here` minus number of `there` so far
  TimeOrder order;
  auto split = both.end();
  for (auto at = both.begin(); at != both.end(); ++at) {
    before += at->second;
    // If all of `here` should be earlier, the exceptions are those of `there` so far and those of `here` from
    // now on; otherwise, the reverse.
    const int exceptions = std::min(all_here - before, all_there + before);
    if (exceptions >= fewest) continue;
    fewest = exceptions;
    split = std::next(at);
    order.here_is_later = all_there + before == exceptions;
  }
  order.apart = fewest < kMaxExceptionShare * std::min(all_here, all_there);
  const int earlier = order.here_is_later ? -1 : 1;
  for (auto at = both.begin(); at != split; ++at) {
    if (at->second == earlier) order.last_before = at->first;
  }
  const auto after = std::find_if(split, both.end(), [&](const auto& at) { return at.second != earlier; });
  if (after != both.end()) order.first_after = after->first;
  return order;
}

bool is_moved(const BundleMap& map, const TagId& tag) {
  return std::ranges::find(map.moved_tags, tag, &MovedTag::tag) != map.moved_tags.end();
}

std::string describe(const SecondPlace& place) {
  const std::string both = fmt::format("{} was observed at two places, {:.2f} m apart ({} and {} times)",
                                       to_string(place.tag), place.distance_m, place.here, place.there);
  if (place.at_once) return both + ", also in one frame: two tags carry this id; change one of them";
  if (place.one_after_the_other && place.distance_m < kMaxPushed_m)
    return both + ", one after the other: it was moved during the lap; repeat the lap with fixed tags";
  return both + ": two tags carry this id, or the tag was moved by hand; change one of them";
}

double position_sigma_m(const MappedTag& tag) {
  if (!tag.covariance) return 0;
  const auto P = coordinate_covariance(Uncertain<SE3>{tag.map_T_tag, *tag.covariance});
  return std::sqrt(P.topLeftCorner<3, 3>().diagonal().maxCoeff());
}

/// For each tag, the length of its longest side in all observations.
std::map<TagId, double> largest_sides_px(const LapInput& lap) {
  std::map<TagId, double> largest;
  for (const TagFrame& frame : lap.frames) {
    for (const TagDetection& detection : frame.detections) {
      double& so_far = largest[detection.tag];
      if (usable_corners(detection)) so_far = std::max(so_far, mean_side_px(detection.corners_px));
    }
  }
  return largest;
}

void check_scale(const LapInput& lap, const BundleMap& map, std::vector<std::string>& warnings) {
  constexpr double kMinReportedError = 0.08;
  const double scale = map.odometry_scales.distance;
  const double sigma = map.odometry_scales_sigma.distance;
  if (!(sigma > 0) || std::abs(scale - 1) < std::max(kMinReportedError, 4 * sigma)) return;
  std::string sentence = fmt::format(
      "according to the tags, the robot drove {:.0f} % {} than odometry reports: tag sizes appear {:.0f} % "
      "too {}",
      100 * std::abs(scale - 1), scale > 1 ? "farther" : "less", 100 * std::abs(scale - 1),
      scale > 1 ? "large" : "small");
  if (lap.sizes.default_size_m)
    sentence += fmt::format(" (is the size {:.3f} m instead of {:.3f} m?)", *lap.sizes.default_size_m / scale,
                            *lap.sizes.default_size_m);
  warnings.push_back(sentence +
                     "; measure the black square of a tag, and check the wheel radius in the robot file");
}

void check_sizes(const BundleMap& map, std::vector<std::string>& warnings) {
  for (const WrongSize& wrong : map.wrong_sizes)
    warnings.push_back(
        fmt::format("{}: its observations fit a side of {:.4f} +- {:.4f} m, given {:.4f} m ({:.1f} sigma); "
                    "the map has the "
                    "side that fits. Measure its black square",
                    to_string(wrong.tag), wrong.found_m, wrong.sigma_m, wrong.given_m, wrong.deviations));
  constexpr double kGate = 3;
  const double off = std::abs(map.size_scale - 1);
  if (off > kGate * map.size_prior_sigma)
    warnings.push_back(
        fmt::format("according to odometry, the camera mounting or the extended map, tags are {:.3f} times "
                    "their given size ({:.1f} sigma)",
                    map.size_scale, off / map.size_prior_sigma));
  constexpr double kClearlyMore = 1.5;
  if (map.size_spread > kClearlyMore * map.assumed_size_spread)
    warnings.push_back(
        fmt::format("printed sizes differ from the given ones by {:.1f} % (one sigma), assumed {:.1f} %; the "
                    "covariances contain this. Measure the black squares, or set `tag_size_sigma_percent`",
                    100 * map.size_spread, 100 * map.assumed_size_spread));
}

void check_missing(const BundleMap& map, std::vector<std::string>& warnings) {
  for (std::string& warning : describe(map.missing_tags, [](const TagId& tag) { return to_string(tag); }))
    warnings.push_back(std::move(warning));
}

/// The names of at most five tags.
std::string names_of(const std::vector<TagId>& tags) {
  constexpr std::size_t kMaxNamed = 5;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min(tags.size(), kMaxNamed); ++i) names.push_back(to_string(tags[i]));
  return fmt::format("{}{}", fmt::join(names, ", "),
                     tags.size() > kMaxNamed ? fmt::format(" and {} more", tags.size() - kMaxNamed) : "");
}

void check_unconfirmed(const BundleMap& map, std::vector<std::string>& warnings) {
  if (map.unconfirmed.empty()) return;
  warnings.push_back(
      fmt::format("{}: not mapped; no observation of {} is confirmed by another (probably a misread id)",
                  names_of(map.unconfirmed), map.unconfirmed.size() == 1 ? "it" : "them"));
}

/// Reports parts of several tags; check_tags() reports single ones.
void check_thin_cuts(const BundleMap& map, std::vector<std::string>& warnings) {
  std::vector<TagCut> parts = map.thin_cuts;
  std::erase_if(parts, [](const TagCut& cut) { return cut.beyond.size() == 1; });
  for (std::string& warning : describe(parts, names_of)) warnings.push_back(std::move(warning));
}

/// Whether all other tags depend on the few observations of this one, which check_thin_cuts() reports.
bool connects_a_part(const BundleMap& map, const TagId& tag) {
  return std::ranges::any_of(map.thin_cuts, [&](const TagCut& cut) {
    return cut.beyond.size() > 1 && cut.by == std::vector<TagId>{tag} &&
           cut.observations == map.observations.at(tag);
  });
}

void check_tags(const LapInput& lap, const BundleMap& map, std::vector<std::string>& warnings) {
  std::map<TagId, double> largest_px = largest_sides_px(lap);
  for (const auto& [id, tag] : map.map.tags) {
    if (connects_a_part(map, id)) continue;
    const int observations = map.observations.at(id);
    const double sigma = position_sigma_m(tag);
    const bool of_prior = lap.prior && lap.prior->map.find(id) != nullptr;
    if ((observations >= kMaxFewObservations || of_prior) && sigma < kWeakSigma) continue;
    warnings.push_back(
        fmt::format("{} has only {} observation{} (largest {:.0f} px); its standard deviation is {:.0f} mm; "
                    "drive closer to it",
                    to_string(id), observations, observations == 1 ? "" : "s", largest_px[id], 1000 * sigma));
  }
  for (const TagId& id : map.unconnected) {
    warnings.push_back(
        fmt::format("{} was never observed together with a tag connected to the anchor: it is not in the map",
                    to_string(id)));
  }
}

/// The pose that most rejected observations agree on, and the stamps of these observations.
struct AgreedPlace {
  SE3 map_T_tag{};
  std::vector<SensorTime> stamps{};
};

std::optional<AgreedPlace> agreed_place(const std::vector<Observation>& observations) {
  std::vector<Vote<SE3>> votes;
  votes.reserve(observations.size());
  for (const Observation& observation : observations) votes.push_back(observation.vote);
  const auto agreed = internal::agree(votes, internal::kPoseGate);
  if (!agreed) return std::nullopt;
  AgreedPlace place{.map_T_tag = agreed->value.mean};
  for (const Observation& observation : observations) {
    if (shows(observation, place.map_T_tag)) place.stamps.push_back(observation.stamp);
  }
  return place;
}

/// Times at which a tag was certainly at its pose in the map and not elsewhere. From far away, the two poses
/// cannot be distinguished. O(observations of the tag), each of which is estimated again.
std::vector<SensorTime> surely_here(const TagId& tag, const MappedTag& mapped,
                                    const std::set<SensorTime>& rejected, const LapInput& lap,
                                    const BundleMap& map, const SE3& elsewhere) {
  std::vector<SensorTime> stamps;
  for_observations(
      tag, lap, map, [](SensorTime) { return true; },
      [&](const Observation& observation) {
        const bool here = !rejected.contains(observation.stamp) || shows(observation, mapped.map_T_tag);
        if (here && !shows(observation, elsewhere)) stamps.push_back(observation.stamp);
      });
  return stamps;
}

/// Whether a place has few observations compared with another tag at that place, which indicates that the
/// other tag's id was misread.
bool misread_for_another(const SecondPlace& place, const BundleMap& map) {
  constexpr double kSame_m = 0.1;
  constexpr double kMaxMisreadShare = 0.2;
  return std::ranges::any_of(map.map.tags, [&](const auto& other) {
    const double apart_m = (other.second.map_T_tag.translation() - place.map_T_tag.translation()).norm();
    return other.first != place.tag && apart_m < kSame_m &&
           place.there < kMaxMisreadShare * map.observations.at(other.first);
  });
}

/// The stamps of a tag's rejected observations, and of those that were excluded before the search.
struct RejectedStamps {
  std::set<SensorTime> all{};
  std::set<SensorTime> excluded{};
};

std::map<TagId, RejectedStamps> rejected_stamps(const BundleMap& map) {
  std::map<TagId, RejectedStamps> rejected;
  for (const RejectedObservation& observation : map.rejected) {
    RejectedStamps& of_tag = rejected[observation.tag];
    of_tag.all.insert(observation.stamp);
    if (std::isinf(observation.chi2)) of_tag.excluded.insert(observation.stamp);
  }
  return rejected;
}

/// Whether a place is more than a few detection errors: it has a share of the tag's observations, or these
/// were excluded because they differ from the others.
bool is_observed_enough(const SecondPlace& place, const std::vector<SensorTime>& stamps,
                        const RejectedStamps& rejected) {
  constexpr double kMinShare = 0.05;
  constexpr int kMinExcluded = 6;  // at least eight are excluded, and most of them agree
  const auto excluded =
      std::ranges::count_if(stamps, [&](SensorTime stamp) { return rejected.excluded.contains(stamp); });
  return excluded >= kMinExcluded || place.there >= kMinShare * (place.here + place.there);
}

}  // namespace

std::vector<SecondPlace> second_places(const LapInput& lap, const BundleMap& map) {
  constexpr std::size_t kMinObservationsOfPlace = 4;
  constexpr double kMinDistance_m = 0.03;
  std::vector<SecondPlace> places;
  for (const auto& [tag, rejected] : rejected_stamps(map)) {
    const MappedTag* mapped = map.map.find(tag);
    if (rejected.all.size() < kMinObservationsOfPlace || mapped == nullptr || is_moved(map, tag)) continue;
    const auto agreed = agreed_place(observations_elsewhere(tag, *mapped, rejected.all, lap, map));
    if (!agreed || agreed->stamps.size() < kMinObservationsOfPlace) continue;
    SecondPlace place{.tag = tag,
                      .map_T_tag = agreed->map_T_tag,
                      .here = map.observations.at(tag),
                      .there = static_cast<int>(agreed->stamps.size())};
    place.distance_m = (place.map_T_tag.translation() - mapped->map_T_tag.translation()).norm();
    if (place.distance_m < kMinDistance_m || misread_for_another(place, map)) continue;
    if (!is_observed_enough(place, agreed->stamps, rejected)) continue;
    place.at_once = seen_twice_at_once(tag, lap);
    const TimeOrder order =
        time_order(surely_here(tag, *mapped, rejected.all, lap, map, agreed->map_T_tag), agreed->stamps);
    place.one_after_the_other = order.apart;
    place.is_before_move = order.apart && order.here_is_later && !place.at_once &&
                           place.distance_m < kMaxPushed_m && tag != lap.anchor;
    place.last_before_s = to_seconds(order.last_before - lap.frames.front().stamp);
    place.first_after_s = to_seconds(order.first_after - lap.frames.front().stamp);
    places.push_back(place);
  }
  return places;
}

namespace {

/// The number of tags in two places, including those whose move explains this.
std::size_t tags_in_two_places(const std::vector<SecondPlace>& places, const BundleMap& map) {
  return places.size() + map.moved_tags.size();
}

/// Whether tags in two places have a common cause. If every place is explained by a move, they do not.
bool are_too_many(const std::vector<SecondPlace>& places, const BundleMap& map) {
  constexpr std::size_t kMaxReported = 4;
  return !places.empty() && tags_in_two_places(places, map) > std::max(kMaxReported, map.map.tags.size() / 3);
}

/// Reports tags that were moved or observed in two places; if there are many of them, the camera calibration
/// is the likely cause.
void check_places(const LapInput& lap, const BundleMap& map, std::vector<std::string>& warnings) {
  const std::vector<SecondPlace> places = second_places(lap, map);
  if (are_too_many(places, map)) {
    warnings.push_back(fmt::format(
        "{} of {} tags appear at two places: check the tag sizes, and that the calibration belongs to "
        "this camera (`waymark calibrate camera`)",
        tags_in_two_places(places, map), map.map.tags.size()));
    return;
  }
  for (const MovedTag& moved : map.moved_tags)
    warnings.push_back(fmt::format("{}: {}", to_string(moved.tag), describe(moved)));
  for (const SecondPlace& place : places) warnings.push_back(describe(place));
}

}  // namespace

std::vector<std::string> check_map(const LapInput& lap, const BundleMap& map) {
  std::vector<std::string> warnings;
  check_scale(lap, map, warnings);
  check_sizes(map, warnings);
  check_places(lap, map, warnings);
  check_missing(map, warnings);
  warnings.insert(warnings.end(), map.prior_warnings.begin(), map.prior_warnings.end());
  check_thin_cuts(map, warnings);
  check_tags(lap, map, warnings);
  check_unconfirmed(map, warnings);
  internal::check_observations(lap, map, warnings);
  internal::check_mounting(map, warnings);
  internal::check_regions(map, warnings);
  internal::check_line(map, warnings);
  internal::check_blindness(lap, map, warnings);
  return warnings;
}

namespace {

using internal::vote_for_place;
using Reason = RejectionReason;

constexpr std::array<const char*, kRejectionReasons> kOfMany = {
    "{} put the tag elsewhere (a misread id or a moved tag)", "{} match the other pose of the tag",
    "{} have inaccurate corners", "{} give no pose"};
constexpr std::array<const char*, kRejectionReasons> kOfOne = {"{} elsewhere", "{} as the other pose",
                                                               "{} inaccurate", "{} without a pose"};

Reason reason_of(const Vote<SE3>& vote, const MappedTag* tag) {
  if (vote.empty()) return Reason::NoPose;
  if (tag == nullptr) return Reason::Elsewhere;
  if (distance2(vote.front(), tag->map_T_tag) < internal::kPoseGate) return Reason::Inexact;
  const bool other = vote.size() > 1 && distance2(vote.back(), tag->map_T_tag) < internal::kPoseGate;
  return other ? Reason::OtherPose : Reason::Elsewhere;
}

/// The reason for a rejection. If an id occurs twice in a frame, the detection with the stronger reason is
/// used.
Reason reason_of(const RejectedObservation& observation, const LapInput& lap, const BundleMap& map) {
  const auto frames = std::ranges::equal_range(lap.frames, observation.stamp, {}, &TagFrame::stamp);
  const auto base = std::ranges::lower_bound(map.trajectory, observation.stamp, {}, &StampedPose::stamp);
  Reason reason = Reason::NoPose;
  if (base == map.trajectory.end() || base->stamp != observation.stamp) return reason;
  for (const TagFrame& frame : frames) {
    for (const TagDetection& seen : frame.detections) {
      if (seen.tag != observation.tag) continue;
      const Vote<SE3> vote = vote_for_place(seen, frame.camera, lap, base->map_T_base);
      reason = std::min(reason, reason_of(vote, map.map.find(observation.tag)));
    }
  }
  return reason;
}

int sum(const RejectionCounts& counts) { return std::accumulate(counts.begin(), counts.end(), 0); }

std::string describe(const RejectionCounts& counts,
                     const std::array<const char*, kRejectionReasons>& reasons) {
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) warnings.push_back(fmt::format(fmt::runtime(reasons[i]), counts[i]));
  }
  return fmt::format("{}", fmt::join(warnings, ", "));
}

/// The tags with the most rejections, such as "tag36h11:7 (14 of 90: 12 elsewhere, 2 inaccurate)".
std::string worst_tags(const std::map<TagId, RejectionCounts>& left_out, const BundleMap& map) {
  constexpr std::size_t kMaxNamed = 3;
  std::vector<std::pair<TagId, RejectionCounts>> tags(left_out.begin(), left_out.end());
  std::ranges::stable_sort(tags, std::greater<>{}, [](const auto& tag) { return sum(tag.second); });
  tags.resize(std::min(tags.size(), kMaxNamed));
  std::vector<std::string> warnings;
  for (const auto& [tag, counts] : tags) {
    const auto used = map.observations.find(tag);
    warnings.push_back(fmt::format("{} ({} of {}: {})", to_string(tag), sum(counts),
                                   sum(counts) + (used == map.observations.end() ? 0 : used->second),
                                   describe(counts, kOfOne)));
  }
  return fmt::format("{}", fmt::join(warnings, ", "));
}

}  // namespace

const char* to_string(RejectionReason reason) {
  constexpr std::array<const char*, kRejectionReasons> kNames = {"elsewhere", "other_pose", "inexact_corners",
                                                                 "no_pose"};
  return kNames[static_cast<std::size_t>(reason)];
}

std::map<TagId, RejectionCounts> rejections_by_tag(const LapInput& lap, const BundleMap& map) {
  std::map<TagId, RejectionCounts> left_out;
  for (const RejectedObservation& observation : map.rejected)
    ++left_out[observation.tag][static_cast<std::size_t>(reason_of(observation, lap, map))];
  return left_out;
}

void internal::check_observations(const LapInput& lap, const BundleMap& map,
                                  std::vector<std::string>& warnings) {
  int used = 0;
  for (const auto& [id, observations] : map.observations) used += observations;
  const int all = used + static_cast<int>(map.rejected.size());
  constexpr double kMinReportedShare = 0.03;
  if (all == 0 || static_cast<double>(map.rejected.size()) < kMinReportedShare * all) return;
  const std::map<TagId, RejectionCounts> left_out = rejections_by_tag(lap, map);
  RejectionCounts over_the_lap{};
  for (const auto& [tag, counts] : left_out) {
    for (std::size_t i = 0; i < counts.size(); ++i) over_the_lap[i] += counts[i];
  }
  warnings.push_back(fmt::format(
      "{} of {} tag observations are inconsistent with the others and were rejected: {}; most of {}",
      map.rejected.size(), all, describe(over_the_lap, kOfMany), worst_tags(left_out, map)));
}

namespace {

/// A frame that contains an observation of a tag, and the base pose of this frame in the map.
struct Visit {
  const TagDetection* seen = nullptr;
  const TagFrame* frame = nullptr;
  const StampedPose* base = nullptr;
};
using Visits = std::map<TagId, std::vector<Visit>>;

/// The observations in use of each tag in the map that was not moved, in chronological order.
Visits visits_of(const LapInput& lap, const BundleMap& map) {
  std::set<std::pair<SensorTime, TagId>> rejected;
  for (const RejectedObservation& observation : map.rejected)
    rejected.insert({observation.stamp, observation.tag});
  Visits visits;
  for (const TagFrame& frame : lap.frames) {
    const auto base = std::ranges::lower_bound(map.trajectory, frame.stamp, {}, &StampedPose::stamp);
    if (base == map.trajectory.end() || base->stamp != frame.stamp) continue;
    for (const TagDetection& seen : frame.detections) {
      if (usable_corners(seen) && map.map.find(seen.tag) != nullptr && !is_moved(map, seen.tag) &&
          !rejected.contains({frame.stamp, seen.tag}))
        visits[seen.tag].push_back({&seen, &frame, &*base});
    }
  }
  return visits;
}

/// The pose of a tag according to its observations from base poses in the map.
std::optional<SE3> place_by(const LapInput& lap, std::vector<Visit>::const_iterator first,
                            std::vector<Visit>::const_iterator last) {
  std::vector<internal::Vote<SE3>> votes;
  for (auto visit = first; visit != last; ++visit)
    votes.push_back(
        internal::vote_for_place(*visit->seen, visit->frame->camera, lap, visit->base->map_T_base));
  const auto agreed = internal::agree(votes, internal::kPoseGate);
  return agreed ? std::optional(agreed->value.mean) : std::nullopt;
}

double distance_between(const Trajectory& trajectory, const StampedPose* from, const StampedPose* to) {
  double metres = 0;
  for (const StampedPose& pose : trajectory) {
    if (pose.stamp <= from->stamp || pose.stamp > to->stamp) continue;
    metres += (pose.map_T_base.translation() - (&pose - 1)->map_T_base.translation()).norm();
  }
  return metres;
}

/// The two observations between which a tag was out of view for longest.
struct Gap {
  const std::vector<Visit>* of_tag = nullptr;
  std::size_t after = 0;  ///< the first observation after it
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
  constexpr double kMinAway_s = 10;
  const Visits visits = visits_of(lap, map);
  const Gap gap = longest_gap(visits);
  if (gap.away_s < kMinAway_s) return std::nullopt;
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
                     .way_m = distance_between(map.trajectory, left, returned),
                     .before_m = off.translation().norm(),
                     .before_rad = std::abs(off.yaw()),
                     .after_m = (first->translation() - again->translation()).norm()};
}

}  // namespace waymark

namespace waymark::internal {

std::vector<MovedTag> tags_moved_in_view(const std::vector<SecondPlace>& places, const BundleMap& map) {
  if (are_too_many(places, map)) return {};
  std::vector<MovedTag> moved;
  for (const SecondPlace& place : places) {
    if (!place.is_before_move) continue;
    const SE3 change = place.map_T_tag.inverse() * map.map.tags.at(place.tag).map_T_tag;
    moved.push_back({.tag = place.tag,
                     .last_before_s = place.last_before_s,
                     .first_after_s = place.first_after_s,
                     .distance_m = change.translation().norm(),
                     .angle_rad = change.rotation().angle()});
  }
  return moved;
}

void check_regions(const BundleMap& map, std::vector<std::string>& warnings) {
  constexpr std::array<const char*, 9> kNames = {
      "upper left", "top", "upper right", "left", "middle", "right", "lower left", "bottom", "lower right"};
  constexpr int kMinCornersOfRegion = 40;
  constexpr double kMinReported_px = 0.25;
  std::size_t worst = kNames.size();
  double farthest = kMinReported_px;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const ResidualRegion& region = map.regions[i];
    const double off = region.mean_px.norm();
    if (region.corners < kMinCornersOfRegion || off < farthest || off < 0.5 * region.rms_px) continue;
    worst = i;
    farthest = off;
  }
  constexpr double kMaxNoiseRatio = 3;
  if (worst == kNames.size() && map.noise_ratio > kMaxNoiseRatio)
    warnings.push_back(fmt::format(
        "corner errors are {:.0f} times the detector's standard deviation: check that the tags are "
        "flat and the calibration belongs to this camera (`waymark calibrate camera`)",
        map.noise_ratio));
  if (worst == kNames.size()) return;
  const ResidualRegion& region = map.regions[worst];
  warnings.push_back(
      fmt::format("corners in the {} of the image are all displaced by ({:+.2f}, {:+.2f}) px: check that the "
                  "calibration belongs to this camera (`waymark calibrate camera`)",
                  kNames[worst], -region.mean_px.x(), -region.mean_px.y()));
}

void check_line(const BundleMap& map, std::vector<std::string>& warnings) {
  constexpr double kNarrow = 0.03;
  if (map.map.tags.size() < 3) return;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& [id, tag] : map.map.tags)
    mean += tag.map_T_tag.translation() / static_cast<double>(map.map.tags.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& [id, tag] : map.map.tags) {
    const Eigen::Vector3d off = tag.map_T_tag.translation() - mean;
    scatter += off * off.transpose();
  }
  const Eigen::Vector3d spread = symmetric_eigenvalues<3>(scatter).cwiseMax(0.0).cwiseSqrt();
  if (spread[1] > kNarrow * spread[2]) return;
  warnings.emplace_back(
      "all tags are on one line: the map may rotate about it, and positions across it are uncertain; add a "
      "tag "
      "well off the line");
}

void check_blindness(const LapInput& lap, const BundleMap& map, std::vector<std::string>& warnings) {
  constexpr double kMinReported_s = 2.0;
  std::set<std::pair<SensorTime, TagId>> rejected;
  for (const RejectedObservation& observation : map.rejected)
    rejected.insert({observation.stamp, observation.tag});
  std::optional<SensorTime> last;
  double longest = kMinReported_s;
  SensorTime from{};
  for (const TagFrame& frame : lap.frames) {
    const bool sees = std::ranges::any_of(frame.detections, [&](const TagDetection& seen) {
      return usable_corners(seen) && map.map.find(seen.tag) != nullptr &&
             !rejected.contains({frame.stamp, seen.tag});
    });
    if (!sees) continue;
    if (last && to_seconds(frame.stamp - *last) > longest) {
      longest = to_seconds(frame.stamp - *last);
      from = *last;
    }
    last = frame.stamp;
  }
  if (longest <= kMinReported_s) return;
  warnings.push_back(fmt::format(
      "no mapped tag was observed for {:.1f} s from {:.1f} s on: {}; uncover the camera or add a tag there",
      longest, to_seconds(from - lap.frames.front().stamp),
      lap.odometry.empty() ? "without odometry, the route crosses that part on a straight line"
                           : "odometry alone determines that part"));
}

namespace {

/// The significant parameters of a mounting that are not zero when printed, such as "-12 mm forward (+- 4),
/// ...".
std::vector<std::string> significant_offsets(const MountingEstimate& mounting) {
  struct Number {
    double unit;
    int digits;
    const char* name;
  };
  constexpr double kDegrees = 180 / std::numbers::pi;
  constexpr std::array<Number, 6> kPrinted = {{{1000, 0, " mm forward"},
                                               {1000, 0, " mm to the left"},
                                               {1000, 0, " mm up"},
                                               {kDegrees, 1, " deg about the forward axis"},
                                               {kDegrees, 1, " deg downwards"},
                                               {kDegrees, 1, " deg to the left"}}};
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < kPrinted.size(); ++i) {
    const Number& number = kPrinted[i];
    const double off = number.unit * mounting.off[static_cast<Eigen::Index>(i)];
    const double range = 2 * number.unit * mounting.sigma[static_cast<Eigen::Index>(i)];
    const double least = std::max(range, 1.5 * std::pow(10.0, -number.digits));
    if (mounting.unobservable[i] || std::abs(off) < least) continue;
    warnings.push_back(
        fmt::format("{:+.{}f}{} (+- {:.{}f})", off, number.digits, number.name, range, number.digits));
  }
  return warnings;
}

}  // namespace

void check_mounting(const BundleMap& map, std::vector<std::string>& warnings) {
  if (!map.mounting || !(map.mounting->any_significant() || map.mounting_used)) return;
  const std::vector<std::string> off = significant_offsets(*map.mounting);
  if (!off.empty())
    warnings.push_back(
        fmt::format("the camera mounting differs from the robot file: {}{}", fmt::join(off, ", "),
                    map.mounting_used
                        ? "; the estimate is used here and in the robot.yaml next to the map"
                        : "; the estimate is not used; measure the mounting with `waymark calibrate robot`"));
  if (!map.mounting_used) return;
  constexpr std::array<const char*, 6> kNames = {
      "the forward position", "the lateral position", "the height", "the roll", "the pitch", "the yaw"};
  std::vector<const char*> unobservable;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (map.mounting->unobservable[i]) unobservable.push_back(kNames[i]);
  }
  warnings.push_back(fmt::format(
      "the lap does not determine {} of the camera mounting; the robot file is used instead. Bends "
      "to both sides "
      "at two speeds determine all but the height",
      fmt::join(unobservable, ", ")));
}

}  // namespace waymark::internal
