#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/app/common/convert_video.hpp"
#include "waymark/config/field_size.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/samples/tag_sizes.hpp"
#include "waymark/samples/trajectory.hpp"

/// `waymark map walk.mp4`: tags in six degrees of freedom from the video of a camera that is carried by hand.
namespace waymark {

/// A distance between the centres of two tags, measured with this standard deviation.
struct MeasuredDistance {
  TagId a{}, b{};
  double measured_m = 0, sigma_m = 0.005;
};

struct MapVideoJob {
  static constexpr double kFlat_m = 0.005;  ///< how flat a floor, a wall is (standard deviation)

  std::vector<std::string> videos{};  ///< of one camera and one place
  CameraModel camera;
  /// Standard deviations of the camera's numbers (intrinsics_of), by its calibration: it is adjusted within
  /// them, and they are part of every covariance. Empty: exact.
  Eigen::VectorXd intrinsics_sigma{};
  double readout_s = 0;  ///< of a rolling shutter, first row to last, negative from the bottom; 0: global
  TagSizes sizes{};
  /// Relative standard deviation of the size of all tags together: they come from one printer.
  double size_sigma = 0.003;
  /// Unless given: where prior_sigma_m or prior_sigma_rad is, all seen tags of `prior`; else the tag that is
  /// seen most, among those of `prior` if there is one. Several stand where `prior` has them.
  std::vector<TagId> anchors{};
  std::optional<SE3> map_T_anchor{};  ///< of one anchor; unless given: as `prior` has it, else upright at the
                                      ///< origin
  TagMap prior{};                     ///< with which the map is compared; empty: none
  std::optional<FieldSize> field{};   ///< that the layouts state; unless given: the box of the tags
  /// How well `prior` is known, beside its own covariances; unless given: exactly.
  std::optional<double> prior_sigma_m{}, prior_sigma_rad{};
  std::vector<MeasuredDistance> distances{};
  std::vector<TagId> upright{};              ///< hang on a vertical wall and are not turned in it
  std::vector<TagId> floor{};                ///< lie on the floor, z = 0
  std::vector<std::vector<TagId>> planes{};  ///< each: tags in one plane, wherever it is
  double level_sigma_rad = 0.0175;           ///< of the directions of all these
  std::filesystem::path folder{};            ///< of what is written
  SearchOptions search{};
};

/// A tag beside the place that the prior map gives it.
struct TagBesidePrior {
  TagId tag{};
  Eigen::Vector3d off_m = Eigen::Vector3d::Zero();    ///< found minus prior, in the map
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Zero();  ///< of what was found
  double turned_rad = 0;
};

/// A measured distance and the one in the map.
struct MeasuredResidual {
  MeasuredDistance given{};
  double found_m = 0;
};

struct MapVideoReport {
  SceneMap map{};
  MapFile file{};           ///< as it is written
  Trajectory trajectory{};  ///< map_T_camera
  std::size_t pictures = 0;
  /// Mean of the squared errors of corners over what the detector's own covariances foretell, of pictures
  /// with several tags and by degree of freedom: 1 when those covariances are true.
  double corner_chi2_per_dof = 0;
  std::vector<MeasuredResidual> measured{};  ///< of the distances
  std::vector<TagBesidePrior> beside{};
  std::vector<std::string> warnings{};
  std::vector<std::string> files{};
  double wall_s = 0;
};

/// Finds the tags of every picture, adjusts all of them together, and writes map.yaml, layout.json (WPILib),
/// layout.fmap (Limelight), poses.yaml (TagSLAM), trajectory.txt and summary.json into the folder: all, or
/// nothing.
[[nodiscard]] Result<MapVideoReport> map_video(const MapVideoJob& job, const TagFinder& finder,
                                               const JobControl& control);
/// The same of tags that were found already, of one camera and one view a frame; reads no video and writes
/// nothing.
[[nodiscard]] Result<MapVideoReport> map_views(const MapVideoJob& job, std::vector<SceneFrame> frames,
                                               const JobControl& control);
/// Standard deviations of a tag's centre along the axes of the map; zero where they are not known.
[[nodiscard]] Eigen::Vector3d position_sigma_m(const MappedTag& tag);
[[nodiscard]] nlohmann::ordered_json to_json(const MapVideoReport& report);

}  // namespace waymark
