#include "waymark/app/map/map_extension.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/route_files.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/lap/tag_ties.hpp"

namespace waymark {
namespace {

Error not_in_the_map(const TagId& tag, const char* field) {
  return {.code = ErrorCode::InvalidArgument,
          .message = to_string(tag) + " is not in the map",
          .place = {.key = field}};
}

/// The number of frames in which each tag of the map is observed.
std::map<TagId, int> frames_of(const RecordedLap& recorded, const TagMap& map) {
  std::map<TagId, int> frames;
  for (const TagFrame& frame : recorded.frames) {
    for (const TagDetection& detection : frame.detections) {
      if (usable_corners(detection) && map.find(detection.tag) != nullptr) ++frames[detection.tag];
    }
  }
  return frames;
}

}  // namespace

Status read_extended_map(const std::filesystem::path& path, MapJob& job) {
  Result<MapFile> map = or_wrong_kind(read_map(map_file_of(path)), path, FileUse::OwnMap);
  if (!map) return tl::unexpected(map.error());
  job.extend = std::move(*map);
  std::error_code ignored;
  job.extended_folder = std::filesystem::is_directory(path, ignored) ? path : path.parent_path();
  return {};
}

Status check_extension(const MapJob& job) {
  const auto refuse = [](const char* field, const std::string& why, const char* hint) {
    return fail(ErrorCode::InvalidArgument, why, {.key = field}, hint);
  };
  if (!job.extend) {
    const char* set_extend = "Set `extend` to the map.";
    if (!job.route_name.empty())
      return refuse("route_name", "a named route requires an existing map", set_extend);
    if (!job.freeze.empty() || !job.remove.empty())
      return refuse(job.freeze.empty() ? "remove" : "freeze",
                    "`freeze` and `remove` apply to the tags of an existing map", set_extend);
    if (job.map_sigma_m)
      return refuse("map_sigma", "this option applies only to a map that the lap extends", set_extend);
    return {};
  }
  if (job.overrides.anchor || job.overrides.map_T_anchor)
    return refuse(job.overrides.anchor ? "anchor" : "anchor_pose",
                  "the extended map already defines its frame", "Omit this option.");
  for (const TagId& tag : job.remove) {
    if (job.freeze.contains(tag))
      return refuse("remove", to_string(tag) + " is both removed and frozen",
                    "Name the tag in only one of `remove` and `freeze`.");
  }
  return job.route_name.empty() ? Status() : check_route_name(job.route_name, "route_name");
}

/// Treats a map without covariances as measured by hand: assigns this standard deviation to each tag,
/// independently of the other tags.
void take_as_measured(double sigma_m, TagMap& map) {
  constexpr double kSigma_rad = 0.01;  // for a sheet attached to a wall by eye
  if (std::ranges::any_of(map.tags, [](const auto& tag) { return tag.second.covariance.has_value(); }))
    return;
  Vector6 variance;
  variance << Eigen::Vector3d::Constant(sigma_m * sigma_m),
      Eigen::Vector3d::Constant(kSigma_rad * kSigma_rad);
  const Matrix6 P = variance.asDiagonal();
  for (auto& [id, tag] : map.tags) tag.covariance = from_coordinate_covariance(tag.map_T_tag, P).covariance;
}

Status prepare_extension(const MapJob& job, RecordedLap& recorded, SetupOverrides& overrides,
                         MapLapOptions& options) {
  if (!job.extend) return {};
  LapPrior prior{.map = job.extend->tags, .frozen = job.freeze};
  take_as_measured(job.map_sigma_m.value_or(kMapSigma_m), prior.map);
  for (const TagId& tag : job.freeze) {
    if (prior.map.find(tag) == nullptr) return tl::unexpected(not_in_the_map(tag, "freeze"));
  }
  for (const TagId& tag : job.remove) {
    if (prior.map.find(tag) == nullptr) return tl::unexpected(not_in_the_map(tag, "remove"));
    remove_tag(prior.map, tag);
  }
  for (TagFrame& frame : recorded.frames)
    std::erase_if(frame.detections, [&](const TagDetection& d) { return job.remove.contains(d.tag); });
  const std::map<TagId, int> frames = frames_of(recorded, prior.map);
  if (frames.empty())
    return fail(ErrorCode::NotFound, "no tag in the map to extend is observed in this lap", {},
                "Record a lap with at least two map tags in view.");
  constexpr int kMinAnchorFrames = 10;
  const auto own = frames.find(job.extend->anchor);
  const TagId anchor =
      own != frames.end() && own->second >= kMinAnchorFrames
          ? own->first
          : std::ranges::max_element(frames, {}, [](const auto& f) { return f.second; })->first;
  const MappedTag& mapped = prior.map.tags.at(anchor);
  overrides.anchor = to_string(anchor);
  overrides.map_T_anchor = mapped.map_T_tag;
  if (!overrides.tag_size_m) overrides.tag_size_m = mapped.size_m;
  options.prior = std::move(prior);
  return {};
}

MapFile map_file_of(const MapJob& job, const TagId& anchor, const MappedLap& lap) {
  MapFile map{.tags = lap.map,
              .observations = lap.observations,
              .anchor = anchor,
              .provenance = {{"method", std::string(to_string(job.options.method))},
                             {"recording", std::filesystem::path(job.lap).filename().string()}}};
  if (!job.extend) return map;
  for (const auto& [tag, count] : job.extend->observations) {
    if (map.tags.find(tag) != nullptr) map.observations[tag] += count;
  }
  if (map.tags.find(job.extend->anchor) != nullptr) map.anchor = job.extend->anchor;
  std::string recordings;
  for (const auto& [key, value] : job.extend->provenance) {
    if (key == "recording" || key == "extends") recordings += (recordings.empty() ? "" : ", ") + value;
  }
  map.provenance.emplace_back("extends", recordings.empty() ? "a map" : recordings);
  return map;
}

}  // namespace waymark
