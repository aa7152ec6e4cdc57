#include "waymark/mapping/lap/left_out.hpp"

#include <algorithm>
#include <functional>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/mapping/lap/tag_votes.hpp"

namespace waymark {
namespace {

using internal::Vote;
using internal::vote_for_place;
using Reason = LeftOutReason;

constexpr std::array<const char*, kLeftOutReasons> kOfMany = {
    "{} put the tag elsewhere (a wrong id, or it was moved)", "{} show the other of its two poses",
    "{} have inexact corners", "{} give no pose"};
constexpr std::array<const char*, kLeftOutReasons> kOfOne = {"{} elsewhere", "{} as the other pose",
                                                             "{} inexact", "{} without a pose"};

Reason reason_of(const Vote<SE3>& vote, const MappedTag* tag) {
  if (vote.empty()) return Reason::NoPose;
  if (tag == nullptr) return Reason::Elsewhere;
  if (distance2(vote.front(), tag->map_T_tag) < internal::kPoseGate) return Reason::Inexact;
  const bool other = vote.size() > 1 && distance2(vote.back(), tag->map_T_tag) < internal::kPoseGate;
  return other ? Reason::OtherPose : Reason::Elsewhere;
}

/// Where an id is twice in a frame, the one that contradicts more is meant.
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

int sum(const LeftOutCounts& counts) { return std::accumulate(counts.begin(), counts.end(), 0); }

std::string in_words(const LeftOutCounts& counts, const std::array<const char*, kLeftOutReasons>& reasons) {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) words.push_back(fmt::format(fmt::runtime(reasons[i]), counts[i]));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

/// "tag36h11:7 (14 of 90: 12 elsewhere, 2 inexact)", those that lost most.
std::string worst_tags(const std::map<TagId, LeftOutCounts>& left_out, const BundleMap& map) {
  constexpr std::size_t kMost = 3;
  std::vector<std::pair<TagId, LeftOutCounts>> tags(left_out.begin(), left_out.end());
  std::ranges::stable_sort(tags, std::greater<>{}, [](const auto& tag) { return sum(tag.second); });
  tags.resize(std::min(tags.size(), kMost));
  std::vector<std::string> words;
  for (const auto& [tag, counts] : tags) {
    const auto used = map.observations.find(tag);
    words.push_back(fmt::format("{} ({} of {}: {})", to_string(tag), sum(counts),
                                sum(counts) + (used == map.observations.end() ? 0 : used->second),
                                in_words(counts, kOfOne)));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace

const char* to_string(LeftOutReason reason) {
  constexpr std::array<const char*, kLeftOutReasons> kNames = {"elsewhere", "other_pose", "inexact_corners",
                                                               "no_pose"};
  return kNames[static_cast<std::size_t>(reason)];
}

std::map<TagId, LeftOutCounts> left_out_by_tag(const LapInput& lap, const BundleMap& map) {
  std::map<TagId, LeftOutCounts> left_out;
  for (const RejectedObservation& observation : map.rejected)
    ++left_out[observation.tag][static_cast<std::size_t>(reason_of(observation, lap, map))];
  return left_out;
}

void internal::check_observations(const LapInput& lap, const BundleMap& map,
                                  std::vector<std::string>& words) {
  int used = 0;
  for (const auto& [id, observations] : map.observations) used += observations;
  const int all = used + static_cast<int>(map.rejected.size());
  constexpr double kMany = 0.03;
  if (all == 0 || static_cast<double>(map.rejected.size()) < kMany * all) return;
  const std::map<TagId, LeftOutCounts> left_out = left_out_by_tag(lap, map);
  LeftOutCounts over_the_lap{};
  for (const auto& [tag, counts] : left_out) {
    for (std::size_t i = 0; i < counts.size(); ++i) over_the_lap[i] += counts[i];
  }
  words.push_back(
      fmt::format("{} of {} observations of tags contradict the others and were left out: {}; most of {}",
                  map.rejected.size(), all, in_words(over_the_lap, kOfMany), worst_tags(left_out, map)));
}

}  // namespace waymark
