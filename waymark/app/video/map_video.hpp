#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/common/changed_tag_fields.hpp"
#include "waymark/app/common/duplicate_tag_fields.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/common/tag_names.hpp"
#include "waymark/app/common/wrong_size_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/config/exchange/field_layouts.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/samples/tag_sizes.hpp"
#include "waymark/samples/trajectory.hpp"
#include "waymark/tags/tag_finder.hpp"

/// `waymark map video`: estimates tag poses in six degrees of freedom from videos taken with a hand-held
/// camera.
namespace waymark {

/// A measured distance between the centres of two tags.
struct MeasuredDistance {
  TagId a{}, b{};
  double measured_m = 0, sigma_m = 0.005;
};

/// Parses "3,7,2.41" (two tag ids and a distance in metres), or "3,7,2.41,0.002" with a standard deviation.
/// Errors name the field `distance`.
[[nodiscard]] Result<MeasuredDistance> parse_distance(const std::string& text,
                                                      SearchedFamilies families = {});

struct MapVideoJob {
  static constexpr double kFlat_m = 0.005;  ///< flatness of floors and walls, as a standard deviation
  static constexpr double kUsualLevelSigma_deg = 1;
  static constexpr double kUsualPriorSigma_deg = 2;

  /// Videos, or recordings from a camera without a robot. All must be from the same camera in the same place.
  std::vector<std::string> videos{};
  std::optional<CameraModel> camera{};
  /// Standard deviations of the calibrated intrinsics, in the order used by intrinsics_of(). The intrinsics
  /// are adjusted accordingly, and their uncertainty is included in every covariance. If empty, the
  /// intrinsics are exact.
  Eigen::VectorXd intrinsics_sigma{};
  /// Readout time of a rolling shutter, from the first row to the last. Negative if rows are read from the
  /// bottom, and 0 for a global shutter.
  double readout_s = 0;
  TagSizes sizes{};
  /// By default, all observed tags in `prior` if prior_sigma_m or prior_sigma_deg is set; otherwise the tag
  /// with the most observations (among those in `prior`, if any). If several anchors are set, their poses
  /// must be in `prior`.
  std::vector<TagId> anchors{};
  /// Pose of a single anchor. By default, the pose in `prior` or, if there is none, upright at the origin.
  std::optional<SE3> map_T_anchor{};
  TagMap prior{};  ///< an older map to compare with; empty if there is none
  /// Size written to the layouts; by default, the bounding box of the tags.
  std::optional<FieldSize> field{};
  /// Standard deviations of positions and orientations in `prior`, in addition to its covariances. If neither
  /// is set, `prior` is exact. If only the one for positions is set, kUsualPriorSigma_deg applies to
  /// orientations.
  std::optional<double> prior_sigma_m{}, prior_sigma_deg{};
  std::vector<MeasuredDistance> distances{};
  std::vector<TagId> upright{};              ///< tags that hang upright on vertical walls
  std::vector<TagId> floor{};                ///< tags that lie on the floor (z = 0)
  std::vector<std::vector<TagId>> planes{};  ///< groups of tags that share a plane with an unknown pose
  /// Standard deviation of the orientations of these tags. The default is kUsualLevelSigma_deg.
  std::optional<double> level_sigma_deg{};
  std::filesystem::path folder{};  ///< the output folder
  /// SearchOptions::common_tag_size_sigma_percent: if empty, half a millimetre of the default size.
  SearchOptions search{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.videos, JobField("videos VIDEO ...",
                                "Videos from one camera in one place, or recordings from a camera alone "
                                "(tags or images, without odometry)")
                           .input()
                           .required());
    visit(self.folder, JobField("output FOLDER", "Folder for map and trajectory").required());
    visit(self.prior_sigma_m, JobField("prior_sigma_m NUMBER",
                                       "Standard deviation of the tag positions in the older map [m]; all "
                                       "its tags then define the map frame",
                                       1e-6, 10.0)
                                  .less());
    visit(self.prior_sigma_deg, JobField("prior_sigma_deg NUMBER",
                                         "Standard deviation of the tag orientations in the older map, in "
                                         "degrees. Default: 2 if that of the positions is given",
                                         1e-4, 180.0)
                                    .less());
    visit(self.level_sigma_deg,
          JobField("level_sigma_deg NUMBER",
                   "Standard deviation of the orientations of tags that are upright, on the floor or in one "
                   "plane, in degrees",
                   1e-3, 45.0)
              .usually("1")
              .less());
  }
};

/// Reads the older map of the same place, in any format. If it is a field layout, the field size is read as
/// well.
[[nodiscard]] Status read_prior_map(const std::string& file, MapVideoJob& job);
/// Fails if fields contradict each other or lack their prerequisites. map_video() and map_views() check this
/// as well.
[[nodiscard]] Status check(const MapVideoJob& job);

/// Deviation of a tag from its pose in the prior map.
struct TagBesidePrior {
  TagId tag{};
  Eigen::Vector3d off_m = Eigen::Vector3d::Zero();    ///< estimate minus prior, in the map frame
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Zero();  ///< standard deviations of the estimate
  double turned_rad = 0;
};

/// A measured distance, and the corresponding distance in the map.
struct MeasuredResidual {
  MeasuredDistance given{};
  double found_m = 0;
};

struct MapVideoReport {
  SceneMap map{};
  MapFile file{};           ///< content of map.yaml
  Trajectory trajectory{};  ///< the camera poses (map_T_camera)
  std::size_t images = 0;
  /// Chi-square of the corner residuals per degree of freedom, computed with the detector's covariances over
  /// images with several tags. It is 1 if these covariances are consistent.
  double corner_chi2_per_dof = 0;
  std::vector<MeasuredResidual> measured{};  ///< one entry per measured distance
  std::vector<TagBesidePrior> beside{};
  std::vector<std::string> warnings{};
  std::vector<std::string> files{};
  double wall_s = 0;
};

/// Detects the tags in every image and adjusts all observations jointly. Writes all or none of map.yaml,
/// layout.json (WPILib), layout.fmap (Limelight), poses.yaml (TagSLAM), trajectory.txt and summary.json to
/// the folder. layout.fmap is omitted for tag families that FMAP does not support.
[[nodiscard]] Result<MapVideoReport> map_video(const MapVideoJob& job, const TagFinder& finder,
                                               const JobControl& control);
/// Makes a map from the given detections from one camera, with one view per frame. Reads no video and writes
/// no files.
[[nodiscard]] Result<MapVideoReport> map_views(const MapVideoJob& job, std::vector<SceneFrame> frames,
                                               const JobControl& control);
/// Standard deviations of the tag centre along the map axes. Zero if unknown.
[[nodiscard]] Eigen::Vector3d position_sigma_m(const MappedTag& tag);
/// The content of `--json` and summary.json.
[[nodiscard]] ReportFields fields(const MapVideoReport& report);
[[nodiscard]] ReportFields fields(const TagBesidePrior& tag);
[[nodiscard]] ReportFields fields(const MeasuredResidual& distance);
/// The printed report for a map in this folder.
[[nodiscard]] std::string to_text(const MapVideoReport& report, const std::string& folder);

}  // namespace waymark
