#include "waymark/app/map/recording_sketch.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include "waymark/base/fnv1a.hpp"

namespace waymark {
namespace {

constexpr std::size_t kSketchSize = 32;
constexpr std::size_t kHashDigits = 8;
constexpr const char* kContent = "content";

/// Hash of the id and the rounded corners; `nullopt` if a corner is far outside any image.
std::optional<std::uint32_t> hash_of(const TagDetection& detection) {
  constexpr double kStepsPerPixel = 4;
  constexpr double kMaxPixel = 1e6;
  std::string text = std::to_string(detection.tag.number);
  for (const Eigen::Vector2d& corner : detection.corners_px) {
    for (const double px : {corner.x(), corner.y()}) {
      if (!(std::abs(px) < kMaxPixel)) return std::nullopt;
      text += fmt::format(" {}", std::lround(kStepsPerPixel * px));
    }
  }
  const std::uint64_t hash = fnv1a(text);
  return static_cast<std::uint32_t>(hash ^ (hash >> 32U));
}

/// The largest hash up to which a sketch contains all hashes of its recording.
std::uint32_t complete_to(const RecordingSketch& sketch) {
  return sketch.hashes.size() < kSketchSize ? std::numeric_limits<std::uint32_t>::max()
                                            : sketch.hashes.back();
}

std::string text_of(const RecordingSketch& sketch) {
  std::string text;
  for (const std::uint32_t hash : sketch.hashes) text += fmt::format("{:08x} ", hash);
  return text + sketch.name;
}

/// Reads hashes, each followed by a space, and then the name. Text in another form gives an empty sketch.
RecordingSketch parse_sketch(std::string_view text) {
  RecordingSketch sketch;
  while (text.size() > kHashDigits && text[kHashDigits] == ' ' && sketch.hashes.size() < kSketchSize) {
    std::uint32_t hash = 0;
    const auto [end, problem] = std::from_chars(text.data(), text.data() + kHashDigits, hash, 16);
    if (problem != std::errc() || end != text.data() + kHashDigits) break;
    sketch.hashes.push_back(hash);
    text.remove_prefix(kHashDigits + 1);
  }
  sketch.name = text;
  std::ranges::sort(sketch.hashes);
  return sketch;
}

/// How often a name is listed as a recording of the map.
std::ptrdiff_t times_named(const MapProvenance& provenance, const std::string& name) {
  std::ptrdiff_t times = 0;
  for (const auto& [key, value] : provenance) {
    if (key != "recording" && key != "extends") continue;
    const std::string list = ", " + value + ",";
    const std::string wanted = ", " + name + ",";
    for (std::size_t at = list.find(wanted); at != std::string::npos; at = list.find(wanted, at + 1)) ++times;
  }
  return times;
}

}  // namespace

RecordingSketch sketch_of(std::string name, const std::vector<TagFrame>& frames) {
  std::set<std::uint32_t> smallest;
  for (const TagFrame& frame : frames) {
    for (const TagDetection& detection : frame.detections) {
      const std::optional<std::uint32_t> hash = hash_of(detection);
      if (!hash) continue;
      smallest.insert(*hash);
      if (smallest.size() > kSketchSize) smallest.erase(std::prev(smallest.end()));
    }
  }
  return {.name = std::move(name), .hashes = {smallest.begin(), smallest.end()}};
}

double common_share(const RecordingSketch& a, const RecordingSketch& b) {
  const std::uint32_t limit = std::min(complete_to(a), complete_to(b));
  const auto up_to_limit = [&](const RecordingSketch& sketch) {
    return std::ranges::upper_bound(sketch.hashes, limit) - sketch.hashes.begin();
  };
  const std::ptrdiff_t fewer = std::min(up_to_limit(a), up_to_limit(b));
  std::vector<std::uint32_t> common;
  std::ranges::set_intersection(a.hashes, b.hashes, std::back_inserter(common));
  return fewer > 0 ? static_cast<double>(common.size()) / static_cast<double>(fewer) : 0;
}

std::vector<RecordingSketch> sketches_of(const MapProvenance& provenance) {
  std::vector<RecordingSketch> sketches;
  for (const auto& [key, value] : provenance) {
    if (!key.starts_with(kContent)) continue;
    if (RecordingSketch sketch = parse_sketch(value); !sketch.hashes.empty())
      sketches.push_back(std::move(sketch));
  }
  return sketches;
}

void add_sketches(const std::vector<RecordingSketch>& sketches, MapProvenance& provenance) {
  MapProvenance added;
  for (const RecordingSketch& sketch : sketches) {
    if (sketch.hashes.empty()) continue;
    const std::string key = added.empty() ? kContent : fmt::format("{}_{}", kContent, added.size() + 1);
    added.emplace_back(key, text_of(sketch));
  }
  const auto extends = std::ranges::find(provenance, "extends", &MapProvenance::value_type::first);
  provenance.insert(extends, added.begin(), added.end());
}

std::string repeated_recording(const MapProvenance& extended, const RecordingSketch& recording) {
  constexpr double kSameShare = 0.5;
  constexpr const char* kEffect = "its observations are counted twice, and the map covariance is too small";
  std::ptrdiff_t sketched = 0;
  for (const RecordingSketch& known : sketches_of(extended)) {
    sketched += known.name == recording.name ? 1 : 0;
    const double share = common_share(known, recording);
    if (share > kSameShare)
      return fmt::format(
          "the extended map already contains this recording, under the name {} (about {:.0f} % of the "
          "observations are the same): {}. Extend the map with another lap",
          known.name, 100 * share, kEffect);
  }
  if (!recording.hashes.empty() && sketched >= times_named(extended, recording.name)) return {};
  if (times_named(extended, recording.name) == 0) return {};
  return fmt::format(
      "the extended map already contains a recording named {}: if it is the same recording, {}",
      recording.name, kEffect);
}

}  // namespace waymark
