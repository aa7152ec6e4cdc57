#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/config/map_file.hpp"
#include "waymark/jobs/convert_video.hpp"
#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/samples/tag_sizes.hpp"
#include "waymark/samples/trajectory.hpp"

/// `waymark map walk.mp4`: tags in six degrees of freedom from the video of a camera that is carried by hand.
namespace waymark {

struct MapVideoJob {
  std::vector<std::string> videos{};  ///< of one camera and one place
  CameraModel camera;
  TagSizes sizes{};
  std::optional<TagId>
      anchor{};  ///< unless given: the tag that is seen most, among those of `prior` if there is one
  std::optional<SE3> map_T_anchor{};  ///< unless given: as `prior` has it, else upright at the origin
  TagMap prior{};                     ///< with which the map is compared; empty: none
  std::filesystem::path folder{};     ///< of what is written
  SearchOptions search{};
};

/// A tag beside the place that the prior map gives it.
struct TagBesidePrior {
  TagId tag{};
  Eigen::Vector3d off_m = Eigen::Vector3d::Zero();    ///< found minus prior, in the map
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Zero();  ///< of what was found
  double turned_rad = 0;
};

struct MapVideoReport {
  SceneMap map{};
  MapFile file{};           ///< as it is written
  Trajectory trajectory{};  ///< map_T_camera
  std::size_t pictures = 0;
  double correlated_frames = 1;  ///< by which covariances were multiplied: pictures that count as one
  std::vector<TagBesidePrior> beside{};
  std::vector<std::string> warnings{};
  std::vector<std::string> files{};
  double wall_s = 0;
};

/// Finds the tags of every picture, adjusts all of them together, and writes map.yaml, layout.json (WPILib),
/// poses.yaml (TagSLAM), trajectory.txt and summary.json into the folder: all, or nothing.
[[nodiscard]] Result<MapVideoReport> map_video(const MapVideoJob& job, const TagFinder& finder,
                                               const JobControl& control);
/// Standard deviations of a tag's centre along the axes of the map; zero where they are not known.
[[nodiscard]] Eigen::Vector3d position_sigma_m(const MappedTag& tag);
[[nodiscard]] nlohmann::ordered_json to_json(const MapVideoReport& report);

}  // namespace waymark
