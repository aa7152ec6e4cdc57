#include "waymark/mapping/lap/duplicate_tags.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <ranges>
#include <set>

namespace waymark::internal {
namespace {

using Sites = std::map<TagId, std::vector<WheelSite>>;
constexpr std::size_t kFewestOfASite = 8;  // fewer are misread
constexpr double kSoon_m = 0.5;            // the wheels are trusted to the centimetre

/// How a site of a tag and its main one follow each other.
enum class Second : std::uint8_t { ByTurns, Jumped, Later };

struct DuplicateTag {
  const WheelSite* site = nullptr;
  Second how = Second::Later;
  double driven_m = 0;  ///< when it jumped
};

/// Both sites' observations in order of time: how often it goes from one to the other with little driven
/// between.
DuplicateTag compare(const WheelSite& main, const WheelSite& other) {
  constexpr int kTurns = 4;
  DuplicateTag second{.site = &other};
  int turns = 0;
  const WheelObservation* last = nullptr;
  bool last_of_main = false;
  auto a = main.seen.begin();
  auto b = other.seen.begin();
  while (a != main.seen.end() || b != other.seen.end()) {
    const bool of_main = b == other.seen.end() || (a != main.seen.end() && a->index < b->index);
    const WheelObservation& now = of_main ? *a++ : *b++;
    if (last != nullptr && of_main != last_of_main && now.driven_m - last->driven_m < kSoon_m) {
      ++turns;
      second.driven_m = now.driven_m;
    }
    last = &now;
    last_of_main = of_main;
  }
  if (turns > 0) second.how = turns < kTurns ? Second::Jumped : Second::ByTurns;
  return second;
}

/// Whether a site was seen right before and right after a moment.
bool steady(const WheelSite& site, double driven_m) {
  constexpr auto kFew = 4;
  const auto within = [&](double from, double to) {
    return std::ranges::count_if(
        site.seen, [&](const WheelObservation& s) { return s.driven_m >= from && s.driven_m < to; });
  };
  return within(driven_m - kSoon_m, driven_m) >= kFew && within(driven_m, driven_m + kSoon_m) >= kFew;
}

std::size_t main_of(const std::vector<WheelSite>& sites) {
  return static_cast<std::size_t>(
      std::ranges::max_element(sites, {}, [](const WheelSite& s) { return s.seen.size(); }) - sites.begin());
}

std::vector<DuplicateTag> duplicate_tags_of(const Sites& all) {
  std::vector<DuplicateTag> result;
  for (const auto& [tag, sites] : all) {
    if (sites.empty()) continue;
    const std::size_t main = main_of(sites);
    for (std::size_t i = 0; i < sites.size(); ++i) {
      if (i != main && sites[i].seen.size() >= kFewestOfASite)
        result.push_back(compare(sites[main], sites[i]));
    }
  }
  return result;
}

/// More tags stood still at that moment than jumped.
bool alone_in_jumping(const DuplicateTag& jumped, const std::vector<DuplicateTag>& seconds,
                      const Sites& all) {
  const auto jumps = std::ranges::count_if(seconds, [&](const DuplicateTag& other) {
    return other.how == Second::Jumped && std::abs(other.driven_m - jumped.driven_m) < kSoon_m;
  });
  const auto still = std::ranges::count_if(all, [&](const auto& of_tag) {
    return std::ranges::any_of(of_tag.second,
                               [&](const WheelSite& site) { return steady(site, jumped.driven_m); });
  });
  return still > jumps;
}

/// Tags that were passed twice and found in one place.
std::ptrdiff_t found_again(const Sites& all) {
  return std::ranges::count_if(all, [](const auto& of_tag) {
    const auto enough = [](const WheelSite& site) { return site.seen.size() >= kFewestOfASite; };
    return std::ranges::count_if(of_tag.second, enough) == 1 &&
           of_tag.second[main_of(of_tag.second)].passed_twice;
  });
}

}  // namespace

std::vector<ObservationIndex> observations_of_duplicate_tags(const LapInput& lap,
                                                             const std::vector<ObservedFrame>& observed) {
  const Sites all = wheel_sites(lap, observed);
  const std::vector<DuplicateTag> seconds = duplicate_tags_of(all);
  const auto later = std::ranges::count(seconds, Second::Later, &DuplicateTag::how);
  const bool wheels_are_right = later <= found_again(all);
  std::vector<ObservationIndex> result;
  for (const DuplicateTag& second : seconds) {
    const bool accepted = second.how == Second::ByTurns ||
                          (second.how == Second::Jumped && alone_in_jumping(second, seconds, all)) ||
                          (second.how == Second::Later && wheels_are_right);
    if (!accepted) continue;
    for (const WheelObservation& observation : second.site->seen) result.push_back(observation.index);
  }
  return result;
}

LapInput without(const LapInput& lap, const std::vector<ObservationIndex>& observations) {
  LapInput rest = lap;
  std::map<std::size_t, std::set<std::size_t>> gone;
  for (const ObservationIndex& index : observations) gone[index.frame].insert(index.detection);
  for (const auto& [frame, detections] : gone) {
    std::vector<TagDetection>& all = rest.frames[frame].detections;
    for (const std::size_t detection : std::views::reverse(detections))
      all.erase(all.begin() + static_cast<std::ptrdiff_t>(detection));
  }
  return rest;
}

}  // namespace waymark::internal
