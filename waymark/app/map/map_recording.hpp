#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/exchange/landmarks_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/evaluation/map_errors.hpp"
#include "waymark/pipeline/lap_mapper.hpp"
#include "waymark/replay/route_checks.hpp"

/// `waymark map lap`: makes a map, a route and figures from a recorded lap, and writes them to a folder.
namespace waymark {

/// Default standard deviation of tag positions in a map measured by hand.
inline constexpr double kMapSigma_m = 0.01;

struct MapJob {
  std::string lap{};                ///< the recording of the lap
  std::vector<std::string> more{};  ///< additional files from the same lap, such as tables
  std::filesystem::path folder{};   ///< the output folder
  std::string robot{};  ///< file or name for camera and mounting; if empty, they are taken from the recording
  CameraChoice frames{};  ///< for recordings with several cameras
  SetupOverrides overrides{};
  MapLapOptions options{};
  LandmarkMapOptions points{};   ///< for recordings with tag poses but no corners
  std::optional<World> truth{};  ///< taken from the recording by default
  /// Detects tags in the recorded images even if the recording contains tags. If null, tags are detected only
  /// if the recording has none.
  const TagFinder* finder = nullptr;
  std::optional<LandmarksFile> prior{};     ///< an older map of the same place, used to report changes
  std::optional<MapFile> extend{};          ///< the map to be extended by the lap, if any
  std::filesystem::path extended_folder{};  ///< folder of the map to be extended
  std::string route_name{};  ///< name of the lap's route, which is added to the routes of the extended map
  std::set<TagId> freeze{};  ///< tags in the extended map whose poses are kept fixed
  std::set<TagId> remove{};  ///< tags in the extended map that no longer exist
  /// Standard deviation of tag positions in an extended map without covariances. The default is kMapSigma_m.
  std::optional<double> map_sigma_m{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.lap, JobField("lap LAP", "Recording of a taught lap").input().required());
    visit(self.more,
          JobField("more MORE",
                   "Further files of the same lap, such as tables of odometry or IMU data, or parts of a bag")
              .input());
    visit(self.folder, JobField("output FOLDER", "Folder for map, route and figures").required());
    visit(self.robot,
          JobField("robot FILE",
                   "Camera and its mounting: a robot file, or a name. Default: from the recording"));
    CameraChoice::fields(self.frames, visit);
    visit(self.overrides.anchor, JobField("anchor TAG",
                                          "Anchor tag, which defines the map frame, for example tag36h11:0. "
                                          "Default: that of the recording"));
  }
};

/// Fails if fields contradict each other. map_recording() checks this as well.
[[nodiscard]] Status check(const MapJob& job);

struct MapReport {
  std::string method{};
  MappedLap lap{};
  TagMap true_tags{};      ///< the true tag poses; empty if unknown
  Trajectory true_path{};  ///< true trajectory for the whole lap, in the map frame; empty if unknown
  /// Whether true_path was aligned with the lap, because the anchor pose is unknown.
  bool truth_aligned = false;
  std::optional<TagMapErrors> tag_errors{};
  std::optional<TrajectoryErrors> trajectory_errors{};
  std::optional<int> prior_agreeing{};  ///< number of tags consistent with the prior map
  /// RMS distance of these tags from their positions in the prior map, after alignment.
  double prior_rms_m = 0;
  bool extends = false;  ///< whether the lap extends a map
  std::optional<PoseLapFigures> poses{};
  /// Where the route passes a tag most closely; `nullopt` if the hull of the robot is unknown.
  std::optional<NearestTag> nearest_tag{};
  std::string odometry{};                    ///< source of the odometry in use; empty if there is none
  std::vector<std::string> warnings{};       ///< warnings about the lap and the recording
  std::vector<std::string> files{};          ///< paths of the written files
  std::vector<std::string> renamed_files{};  ///< backups of existing files, named with a numeric suffix
  double wall_s = 0;
  double peak_rss_mib = 0;  ///< peak memory use of the process so far
};

/// Makes a map and a route from a recording, and writes map.yaml, route.yaml, trajectory.txt, robot.yaml,
/// truth_trajectory.txt, summary.json and figures to the folder: either all of them or none. Existing files
/// that belong to an older map, or that have one of these names, are kept as backups (map.1.yaml, …). If
/// cancelled, it fails and leaves the folder unchanged.
[[nodiscard]] Result<MapReport> map_recording(const MapJob& job, const JobControl& control);
/// Makes a map from a lap whose recording contains tag poses but no corners. Writes no files.
[[nodiscard]] Result<MapFile> map_poses(const RecordedLap& recorded, const MapJob& job, MapReport& report);
/// The content of `--json` and summary.json. Errors are null if the ground truth is unknown.
[[nodiscard]] ReportFields fields(const MapReport& report);
[[nodiscard]] ReportFields fields(const LoopClosure& loop);
/// The printed report for a map in this folder.
[[nodiscard]] std::string to_text(const MapReport& report, const std::string& folder);

}  // namespace waymark
