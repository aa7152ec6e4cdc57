#include "waymark/mapping/lap/map_checks.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/lap/lap_diagnosis.hpp"
#include "waymark/mapping/lap/left_out.hpp"
#include "waymark/mapping/lap/tag_votes.hpp"
#include "waymark/pose/agreement.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

using internal::Vote;

constexpr int kFewObservations = 3;
constexpr double kWeakSigma = 0.05;

const SE3* base_at(const BundleMap& map, SensorTime stamp) {
  const auto at = std::ranges::lower_bound(map.trajectory, stamp, {}, &StampedPose::stamp);
  return at != map.trajectory.end() && at->stamp == stamp ? &at->map_T_base : nullptr;
}

/// Where an observation says its tag is.
struct Observation {
  SensorTime stamp{};
  Vote<SE3> vote{};
};

/// A tag's observations, those that show it in its place in the map and those that do not.
struct Split {
  std::vector<Observation> here;
  std::vector<Observation> there;
};

bool shows(const Observation& observation, const SE3& map_T_tag) {
  return internal::nearest(observation.vote, map_T_tag, internal::kPoseGate).first != nullptr;
}

Split split_of(const TagId& tag, const MappedTag& mapped, const std::set<SensorTime>& rejected,
               const LapInput& lap, const BundleMap& map) {
  Split split;
  for (const TagFrame& frame : lap.frames) {
    for (const TagDetection& detection : frame.detections) {
      if (detection.tag != tag) continue;
      const SE3* map_T_base = base_at(map, frame.stamp);
      if (map_T_base == nullptr) continue;
      Observation observation{frame.stamp,
                              internal::vote_for_place(detection, frame.camera, lap, *map_T_base)};
      if (observation.vote.empty()) continue;
      const bool here = !rejected.contains(frame.stamp) || shows(observation, mapped.map_T_tag);
      (here ? split.here : split.there).push_back(std::move(observation));
    }
  }
  return split;
}

bool seen_twice_at_once(const TagId& tag, const LapInput& lap) {
  int frames = 0;
  for (const TagFrame& frame : lap.frames)
    frames += std::ranges::count(frame.detections, tag, &TagDetection::tag) > 1 ? 1 : 0;
  return frames >= 2;
}

/// Whether a moment parts the two, but for a few.
bool apart_in_time(const std::vector<SensorTime>& here, const std::vector<SensorTime>& there) {
  constexpr double kFew = 0.2;
  std::vector<std::pair<SensorTime, int>> both;
  both.reserve(here.size() + there.size());
  for (const SensorTime stamp : here) both.emplace_back(stamp, 1);
  for (const SensorTime stamp : there) both.emplace_back(stamp, -1);
  std::ranges::sort(both);
  const auto all_here = static_cast<int>(here.size());
  const auto all_there = static_cast<int>(there.size());
  int fewest = std::min(all_here, all_there);
  int before = 0;  // here less there
  for (const auto& [stamp, which] : both) {
    before += which;
    // Wrong if all here came before: there so far, and here from now on; or the other way round.
    fewest = std::min({fewest, all_here - before, all_there + before});
  }
  return fewest < kFew * std::min(all_here, all_there);
}

std::string in_words(const SecondPlace& place) {
  const std::string both = fmt::format("{} was seen in two places, {:.2f} m apart ({} and {} times)",
                                       to_string(place.tag), place.distance_m, place.here, place.there);
  if (place.at_once) return both + ", once even together: two tags carry this id; change one of them";
  constexpr double kCarried = 1.0;  // a tag that is pushed or hung anew rarely goes farther
  if (place.one_after_the_other && place.distance_m < kCarried)
    return both + ", one after the other: it was moved during the lap; teach again with the tags at rest";
  return both + ": two tags carry this id (or it was carried there); change one of them";
}

double position_sigma_m(const MappedTag& tag) {
  if (!tag.covariance) return 0;
  const auto P = coordinate_covariance(Uncertain<SE3>{tag.map_T_tag, *tag.covariance});
  return std::sqrt(P.topLeftCorner<3, 3>().diagonal().maxCoeff());
}

/// The longest side any observation of each tag had.
std::map<TagId, double> largest_sides_px(const LapInput& lap) {
  std::map<TagId, double> largest;
  for (const TagFrame& frame : lap.frames) {
    for (const TagDetection& detection : frame.detections) {
      double& so_far = largest[detection.tag];
      so_far = std::max(so_far, mean_side_px(detection.corners_px));
    }
  }
  return largest;
}

void check_scale(const LapInput& lap, const BundleMap& map, std::vector<std::string>& words) {
  constexpr double kWorthSaying = 0.08;
  const double scale = map.odometry_scales.distance;
  const double sigma = map.odometry_scales_sigma.distance;
  if (!(sigma > 0) || std::abs(scale - 1) < std::max(kWorthSaying, 4 * sigma)) return;
  std::string sentence = fmt::format(
      "by the tags the robot drove {:.0f} % {} than by its wheels: tag sizes look {:.0f} % too {}",
      100 * std::abs(scale - 1), scale > 1 ? "farther" : "less far", 100 * std::abs(scale - 1),
      scale > 1 ? "large" : "small");
  if (lap.sizes.default_size_m)
    sentence += fmt::format(" (is it {:.3f} m instead of {:.3f} m?)", *lap.sizes.default_size_m / scale,
                            *lap.sizes.default_size_m);
  words.push_back(sentence + "; measure the black square, or the wheels are not what the robot's file says");
}

void check_unconfirmed(const BundleMap& map, std::vector<std::string>& words) {
  constexpr std::size_t kMost = 5;
  const std::size_t all = map.unconfirmed.size();
  if (all == 0) return;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min(all, kMost); ++i) names.push_back(to_string(map.unconfirmed[i]));
  words.push_back(
      fmt::format("{}{}: no observation of {} is confirmed by another (a misread id, most likely): left out",
                  fmt::join(names, ", "), all > kMost ? fmt::format(" and {} more", all - kMost) : "",
                  all == 1 ? "it" : "them"));
}

void check_tags(const LapInput& lap, const BundleMap& map, std::vector<std::string>& words) {
  std::map<TagId, double> largest_px = largest_sides_px(lap);
  for (const auto& [id, tag] : map.map.tags) {
    const int observations = map.observations.at(id);
    const double sigma = position_sigma_m(tag);
    const bool of_prior = lap.prior && lap.prior->map.find(id) != nullptr;
    if ((observations >= kFewObservations || of_prior) && sigma < kWeakSigma) continue;
    words.push_back(fmt::format(
        "{} hangs on {} view{} of at most {:.0f} px and is known to {:.0f} mm only: drive nearer past it",
        to_string(id), observations, observations == 1 ? "" : "s", largest_px[id], 1000 * sigma));
  }
  for (const TagId& id : map.unconnected) {
    words.push_back(
        fmt::format("{} was never seen together with a tag that leads to the anchor: it is not in the map",
                    to_string(id)));
  }
}

/// Where most of those agree that contradict the map, and which.
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

/// When a tag was surely here: from far away both places look alike.
std::vector<SensorTime> surely_here(const Split& split, const SE3& elsewhere) {
  std::vector<SensorTime> stamps;
  for (const Observation& observation : split.here) {
    if (!shows(observation, elsewhere)) stamps.push_back(observation.stamp);
  }
  return stamps;
}

/// A few of very many observations of the tag that stands there: their ids were read wrongly.
bool misread_for_another(const SecondPlace& place, const BundleMap& map) {
  constexpr double kSame_m = 0.1;
  constexpr double kFew = 0.2;
  return std::ranges::any_of(map.map.tags, [&](const auto& other) {
    const double apart_m = (other.second.map_T_tag.translation() - place.map_T_tag.translation()).norm();
    return other.first != place.tag && apart_m < kSame_m &&
           place.there < kFew * map.observations.at(other.first);
  });
}

}  // namespace

std::vector<SecondPlace> second_places(const LapInput& lap, const BundleMap& map) {
  constexpr std::size_t kEnough = 4;
  constexpr double kApart = 0.03;
  constexpr double kShare = 0.05;  // fewer show an error of the pictures, and are left out without a word
  std::map<TagId, std::set<SensorTime>> rejected;
  for (const RejectedObservation& observation : map.rejected)
    rejected[observation.tag].insert(observation.stamp);
  std::vector<SecondPlace> places;
  for (const auto& [tag, stamps] : rejected) {
    const MappedTag* mapped = map.map.find(tag);
    if (stamps.size() < kEnough || mapped == nullptr) continue;
    const Split split = split_of(tag, *mapped, stamps, lap, map);
    const auto agreed = agreed_place(split.there);
    if (!agreed || agreed->stamps.size() < kEnough) continue;
    SecondPlace place{.tag = tag,
                      .map_T_tag = agreed->map_T_tag,
                      .here = map.observations.at(tag),
                      .there = static_cast<int>(agreed->stamps.size())};
    place.distance_m = (place.map_T_tag.translation() - mapped->map_T_tag.translation()).norm();
    if (place.distance_m < kApart || misread_for_another(place, map)) continue;
    if (place.there < kShare * (place.here + place.there)) continue;
    place.at_once = seen_twice_at_once(tag, lap);
    place.one_after_the_other = apart_in_time(surely_here(split, agreed->map_T_tag), agreed->stamps);
    places.push_back(place);
  }
  return places;
}

namespace {

/// Tags in two places; where that is said of very many, it is the camera that is wrong, not they.
void check_places(const LapInput& lap, const BundleMap& map, std::vector<std::string>& words) {
  const std::vector<SecondPlace> places = second_places(lap, map);
  constexpr std::size_t kFew = 4;
  if (places.size() > std::max(kFew, map.map.tags.size() / 3)) {
    words.push_back(
        fmt::format("{} of {} tags seem to stand in two places: is the calibration this camera's, and are "
                    "the sizes of the tags "
                    "right? `waymark calibrate camera` measures it",
                    places.size(), map.map.tags.size()));
    return;
  }
  for (const SecondPlace& place : places) words.push_back(in_words(place));
}

}  // namespace

std::vector<std::string> check_map(const LapInput& lap, const BundleMap& map) {
  std::vector<std::string> words;
  check_scale(lap, map, words);
  words.insert(words.end(), map.prior_words.begin(), map.prior_words.end());
  check_places(lap, map, words);
  check_tags(lap, map, words);
  check_unconfirmed(map, words);
  internal::check_observations(lap, map, words);
  internal::check_mounting(map, words);
  internal::check_regions(map, words);
  internal::check_line(map, words);
  internal::check_blindness(lap, map, words);
  return words;
}

}  // namespace waymark
