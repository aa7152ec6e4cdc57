#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/common/flag_refusals.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/exchange/field_layouts.hpp"
#include "waymark/config/yaml/map_file.hpp"
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
/// What `waymark map` prints of a map that it wrote into this folder.
[[nodiscard]] std::string to_text(const MapVideoReport& report, const std::string& folder);

/// What a user says of the camera and the place of a video: files, names of tags, degrees, milliseconds.
struct MapVideoDescription {
  CameraDescription camera{};
  double tag_size_sigma_m = 0.0005;
  std::string anchor{};                     ///< tags, "3,7"; empty: chosen
  std::string prior{};                      ///< file of a map; empty: none
  std::optional<double> prior_sigma_m{};    ///< of its places ...
  std::optional<double> prior_sigma_deg{};  ///< ... and directions
  std::vector<std::string> distances{};     ///< "3,7,2.41" or "3,7,2.41,0.002"
  std::vector<std::string> upright{};       ///< tags, "3" or "3,7"
  std::vector<std::string> floor{};
  std::vector<std::string> planes{};  ///< each: tags on one plane, "3,4,7"
  double level_sigma_deg = 1;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.camera.file,
          JobField("camera FILE",
                   "Calibration of the camera of a video, or of the recording of a camera (calibration.yaml, "
                   "ROS camera_info, kalibr YAML or JSON of PhotonVision); the standard deviations of a "
                   "calibration.yaml become part of the map's")
              .grouped("Videos"));
    CameraDescription::fields(self.camera, visit);
    visit(self.camera.readout_ms,
          JobField(
              "readout_ms NUMBER",
              "Time from the first row to the last of the camera's rolling shutter, in milliseconds; "
              "negative when rows are read from the bottom. Unless given: that of a calibration.yaml, else 0",
              -200.0, 200.0)
              .grouped("Videos"));
    visit(self.tag_size_sigma_m, JobField("tag_size_sigma_m NUMBER",
                                          "Standard deviation of --tag-size-m, the same error for all tags "
                                          "of a video [m]; it becomes part of the map's covariance",
                                          0.0, 1.0)
                                     .less());
    visit(self.distances, JobField("distance TAG,TAG,METRES",
                                   "A measured distance between the centres of two tags of a video, which "
                                   "gives the scale: ids, metres and, unless it is 0.005 m, its standard "
                                   "deviation, such as 3,7,2.41 or 3,7,2.41,0.002. May be repeated")
                              .grouped("Videos"));
    visit(self.upright,
          JobField("upright TAGS",
                   "Tags of a video that hang upright on vertical walls, such as 3,7: they level the map")
              .by_commas()
              .grouped("Videos"));
    visit(self.floor, JobField("floor TAGS",
                               "Tags of a video that lie on the floor: they level the map, and z is 0 there")
                          .by_commas()
                          .grouped("Videos"));
    visit(
        self.planes,
        JobField(
            "plane TAGS",
            "Tags of a video that are on one plane, such as one wall, wherever it is: 3,4,7. May be repeated")
            .grouped("Videos"));
    visit(
        self.level_sigma_deg,
        JobField(
            "level_sigma_deg NUMBER",
            "Standard deviation of the directions of the tags of --upright, --floor and --plane, in degrees",
            1e-3, 45.0)
            .less());
    visit(self.prior_sigma_m, JobField("prior_sigma_m NUMBER",
                                       "Standard deviation of the places of --prior, for a video: its tags "
                                       "then hold the map, each within it [m]",
                                       1e-6, 10.0)
                                  .less());
    visit(self.prior_sigma_deg, JobField("prior_sigma_deg NUMBER",
                                         "Standard deviation of the directions of the tags of --prior, for a "
                                         "video, in degrees. Unless given, with --prior-sigma-m: 2",
                                         1e-4, 180.0)
                                    .less());
  }
};

/// A job with the camera, anchors, distances and levels of the description; what else it needs is the
/// caller's. Errors name the flag of `waymark map` at fault, or the file.
[[nodiscard]] Result<MapVideoJob> described_map_video(const MapVideoDescription& description,
                                                      std::optional<double> tag_size_m);
/// The same with what is common to it and the job of a lap.
[[nodiscard]] Result<MapVideoJob> described_map_video(const MapVideoDescription& description,
                                                      const MapJob& common);

/// Of flags that are about robots.
inline constexpr const char* kNotOfVideos = "this has no effect on videos";
inline constexpr const char* kNoRobot = "A video is mapped without a robot and its odometry: leave it out.";
/// Fails on flags that have no effect on videos: about robots, their odometry and their routes, and about
/// what was not given.
[[nodiscard]] Status check_effects(const MapVideoDescription& of, const GivenFlags& given);
/// Fails where a flag about videos was given: the lap is none.
[[nodiscard]] Status check_no_video(const GivenFlags& given);

}  // namespace waymark
