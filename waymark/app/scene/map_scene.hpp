#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/app/common/job_control.hpp"
#include "waymark/mapping/scene/scene_values.hpp"

/// `waymark map --tagslam`: scenes of cameras and bodies that TagSLAM's files describe.
namespace waymark {

struct MapSceneJob {
  std::string recording{};
  std::filesystem::path tagslam{};  ///< folder of TagSLAM's files
  std::filesystem::path folder{};   ///< of what is written
  std::filesystem::path against{};  ///< folder of another solution; empty: none
  SceneMapOptions options{};
};

/// Gives the job the model of this name ("waymark", "tagslam"), and cameras that are adjusted too. Errors
/// name the flag of `waymark map` at fault.
[[nodiscard]] Status describe_scene(const std::string& model, bool free_intrinsics, MapSceneJob& job);

struct MapSceneReport {
  SceneMap map{};
  std::optional<CostAtValues> against{};
  std::vector<std::string> warnings{};
  std::vector<std::string> files{};
  int frames = 0;
  int frames_without_pose = 0;
  double wall_s = 0;
  double peak_rss_mib = 0;
};

/// Maps and writes map.yaml (tags of bodies that stand still), poses.yaml and camera_poses.yaml (as
/// TagSLAM's), trajectory_BODY.txt of each body that moves, and summary.json. Nothing is written when no map
/// can be made.
[[nodiscard]] Result<MapSceneReport> map_scene_recording(const MapSceneJob& job, const JobControl& control);
[[nodiscard]] nlohmann::ordered_json to_json(const MapSceneReport& report);
/// What `waymark map` prints of a map that it wrote into this folder.
[[nodiscard]] std::string to_text(const MapSceneReport& report, const std::string& folder);

}  // namespace waymark
