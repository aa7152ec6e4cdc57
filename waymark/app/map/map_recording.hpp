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

/// `waymark map lap`: makes a map, a route and figures in a folder from a recorded lap.
namespace waymark {

/// Default standard deviation of the tags of a map measured by hand.
inline constexpr double kMapSigma_m = 0.01;

struct MapJob {
  std::string lap{};                ///< the recording
  std::vector<std::string> more{};  ///< further files of the same lap, such as tables
  std::filesystem::path folder{};   ///< for the output
  std::string robot{};              ///< file or name, for camera and mounting; empty: from the recording
  CameraChoice frames{};            ///< for a recording with several cameras
  SetupOverrides overrides{};
  MapLapOptions options{};
  LandmarkMapOptions points{};   ///< for recordings with tag poses but no corners
  std::optional<World> truth{};  ///< default: from the recording
  /// Detects tags in the recorded images even if the recording contains tags. If null, tags are detected only
  /// if the recording has none.
  const TagFinder* finder = nullptr;
  std::optional<LandmarksFile> prior{};     ///< an older map of the place, to report changes
  std::optional<MapFile> extend{};          ///< a map that the lap extends
  std::filesystem::path extended_folder{};  ///< of the extended map
  std::string route_name{};  ///< of the lap, which becomes an additional route of the extended map
  std::set<TagId> freeze{};  ///< tags of the extended map whose pose is fixed
  std::set<TagId> remove{};  ///< tags of the extended map that no longer exist
  /// Standard deviation of tag positions in an extended map without covariances; default: kMapSigma_m.
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

/// Fails if fields contradict each other; map_recording() checks this as well.
[[nodiscard]] Status check(const MapJob& job);

struct MapReport {
  std::string method{};
  MappedLap lap{};
  TagMap true_tags{};          ///< empty if unknown
  Trajectory true_path{};      ///< of the whole lap, in the map frame; empty if unknown
  bool truth_aligned = false;  ///< true_path was aligned with the lap, as the pose of the anchor is unknown
  std::optional<TagMapErrors> tag_errors{};
  std::optional<TrajectoryErrors> trajectory_errors{};
  std::optional<int> prior_agreeing{};  ///< tags consistent with the prior map
  double prior_rms_m = 0;               ///< distance of these tags after alignment, root mean square
  bool extends = false;                 ///< whether the lap extends a map
  std::optional<PoseLapFigures> poses{};
  std::vector<std::string> warnings{};       ///< about lap and recording
  std::vector<std::string> files{};          ///< written files
  std::vector<std::string> renamed_files{};  ///< backups of existing files, with a numeric suffix
  double wall_s = 0;
  double peak_rss_mib = 0;  ///< of the process so far
};

/// Makes a map and a route from a recording and writes map.yaml, route.yaml, trajectory.txt, robot.yaml,
/// truth_trajectory.txt, summary.json and figures into the folder: all of them or none. Existing files of an
/// older map, or with one of these names, are kept as backups (map.1.yaml, …). If cancelled, it fails and
/// leaves the folder unchanged.
[[nodiscard]] Result<MapReport> map_recording(const MapJob& job, const JobControl& control);
/// Makes the map of a lap whose recording contains tag poses but no corners; writes no files.
[[nodiscard]] Result<MapFile> map_poses(const RecordedLap& recorded, const MapJob& job, MapReport& report);
/// The content of `--json` and summary.json; the errors are null if the ground truth is unknown.
[[nodiscard]] ReportFields fields(const MapReport& report);
[[nodiscard]] ReportFields fields(const LoopClosure& loop);
/// The printed report of a map in this folder.
[[nodiscard]] std::string to_text(const MapReport& report, const std::string& folder);

}  // namespace waymark
