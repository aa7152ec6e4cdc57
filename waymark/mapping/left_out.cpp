#include <algorithm>
#include <array>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/mapping/lap_diagnosis.hpp"
#include "waymark/mapping/tag_votes.hpp"

namespace waymark::internal {
namespace {

/// Why a sighting contradicts the map; what contradicts more comes first.
enum class Reason : std::uint8_t { Elsewhere, OtherPose, Inexact, NoPose };
constexpr std::array<const char*, 4> kReasons = {"{} put the tag elsewhere (a wrong id, or it was moved)",
                                                 "{} show the other of its two poses",
                                                 "{} have inexact corners", "{} give no pose"};
using Counts = std::array<int, kReasons.size()>;

Reason reason_of(const Vote<SE3>& vote, const MappedTag* tag) {
  constexpr double kGate = 22.5;  // 0.999 quantile of chi-square with 6 degrees of freedom
  if (vote.empty()) return Reason::NoPose;
  if (tag == nullptr) return Reason::Elsewhere;
  if (distance2(vote.front(), tag->map_T_tag) < kGate) return Reason::Inexact;
  const bool other = vote.size() > 1 && distance2(vote.back(), tag->map_T_tag) < kGate;
  return other ? Reason::OtherPose : Reason::Elsewhere;
}

/// Where an id is twice in a frame, the one that contradicts more is meant.
Reason reason_of(const RejectedSighting& sighting, const LapInput& lap, const BundleMap& map) {
  const auto frame = std::ranges::lower_bound(lap.frames, sighting.stamp, {}, &TagFrame::stamp);
  const auto base = std::ranges::lower_bound(map.trajectory, sighting.stamp, {}, &StampedPose::stamp);
  Reason reason = Reason::NoPose;
  if (frame == lap.frames.end() || frame->stamp != sighting.stamp) return reason;
  if (base == map.trajectory.end() || base->stamp != sighting.stamp) return reason;
  for (const TagDetection& seen : frame->detections) {
    if (seen.tag != sighting.tag) continue;
    const Vote<SE3> vote = vote_for_place(seen, lap, base->map_T_base);
    reason = std::min(reason, reason_of(vote, map.map.find(sighting.tag)));
  }
  return reason;
}

/// "tag36h11:7 (14 of 90)", those that lost most.
std::string worst_tags(const std::map<TagId, int>& left_out, const BundleMap& map) {
  constexpr std::size_t kMost = 3;
  std::vector<std::pair<TagId, int>> tags(left_out.begin(), left_out.end());
  std::ranges::stable_sort(tags, std::greater<>{}, &std::pair<TagId, int>::second);
  tags.resize(std::min(tags.size(), kMost));
  std::vector<std::string> words;
  for (const auto& [tag, count] : tags) {
    const auto used = map.sightings.find(tag);
    words.push_back(fmt::format("{} ({} of {})", to_string(tag), count,
                                count + (used == map.sightings.end() ? 0 : used->second)));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace

void check_sightings(const LapInput& lap, const BundleMap& map, std::vector<std::string>& words) {
  int used = 0;
  for (const auto& [id, sightings] : map.sightings) used += sightings;
  const int all = used + static_cast<int>(map.rejected.size());
  constexpr double kMany = 0.03;
  if (all == 0 || static_cast<double>(map.rejected.size()) < kMany * all) return;
  Counts counts{};
  std::map<TagId, int> left_out;
  for (const RejectedSighting& sighting : map.rejected) {
    ++counts[static_cast<std::size_t>(reason_of(sighting, lap, map))];
    ++left_out[sighting.tag];
  }
  std::vector<std::string> reasons;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) reasons.push_back(fmt::format(fmt::runtime(kReasons[i]), counts[i]));
  }
  words.push_back(
      fmt::format("{} of {} sightings of tags contradict the others and were left out: {}; most of {}",
                  map.rejected.size(), all, fmt::join(reasons, ", "), worst_tags(left_out, map)));
}

}  // namespace waymark::internal
