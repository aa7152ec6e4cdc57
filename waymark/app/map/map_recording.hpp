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

/// `waymark map lap`: a recorded lap becomes a map, a route and figures in a folder.
namespace waymark {

/// Standard deviation of the tags of a map that was measured by hand, unless another is given.
inline constexpr double kMapSigma_m = 0.01;

struct MapJob {
  std::string lap{};                ///< the recording
  std::vector<std::string> more{};  ///< further files of the same lap, such as tables
  std::filesystem::path folder{};   ///< of what is written
  std::string robot{};              ///< file or name: camera and mounting; empty: as the recording says
  CameraChoice frames{};            ///< of a recording that holds several
  SetupOverrides overrides{};
  MapLapOptions options{};
  LandmarkMapOptions points{};   ///< for recordings with poses of tags and no corners
  std::optional<World> truth{};  ///< when given; otherwise what the recording holds
  const TagFinder* finder =
      nullptr;  ///< for the pictures of the recording, when its tags are not to be taken
  std::optional<LandmarksFile> prior{};     ///< an older map of the place, to say what changed since
  std::optional<MapFile> extend{};          ///< a map that the lap is to improve
  std::filesystem::path extended_folder{};  ///< where it came from
  std::string route_name{};  ///< the lap becomes the route of this name, beside those of the extended map
  std::set<TagId> freeze{};  ///< tags of the extended map that stay exactly where it has them
  std::set<TagId> remove{};  ///< tags of the extended map that are gone
  /// Standard deviation of the tags of the extended map, when it does not say how well it knows any of them;
  /// unless given: kMapSigma_m.
  std::optional<double> map_sigma_m{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.lap, JobField("lap LAP", "Recording of a taught lap").input().required());
    visit(self.more,
          JobField("more MORE",
                   "Further files of the same lap: tables of odometry or of an IMU, parts of a bag")
              .input());
    visit(self.folder, JobField("output FOLDER", "Folder for map, route and figures").required());
    visit(self.robot,
          JobField("robot FILE",
                   "Camera and its mounting: a robot file, or a name. Unless given: from the recording"));
    CameraChoice::fields(self.frames, visit);
    visit(self.overrides.anchor,
          JobField("anchor TAG",
                   "Anchor tag, which defines the map frame, for example tag36h11:0. Unless given: that "
                   "of the recording"));
  }
};

/// Fails where fields contradict each other; map_recording() checks it as well.
[[nodiscard]] Status check(const MapJob& job);

struct MapReport {
  std::string method{};
  MappedLap lap{};
  TagMap true_tags{};          ///< empty when not known
  Trajectory true_path{};      ///< of the whole lap, in the map's frame; empty when not known
  bool truth_aligned = false;  ///< true_path was moved onto the lap: nobody told where the anchor stands
  std::optional<TagMapErrors> tag_errors{};
  std::optional<TrajectoryErrors> trajectory_errors{};
  std::optional<int> prior_agreeing{};  ///< tags that stand where the prior map has them
  double prior_rms_m = 0;               ///< how far these are apart
  bool extends = false;                 ///< another map
  std::optional<PoseLapFigures> poses{};
  std::vector<std::string> warnings{};   ///< of the lap and of the file
  std::vector<std::string> files{};      ///< what was written
  std::vector<std::string> set_aside{};  ///< what stood there before, and has a number in its name now
  double wall_s = 0;
  double peak_rss_mib = 0;  ///< of the process so far
};

/// Makes a map and a route of a recording and writes map.yaml, route.yaml, trajectory.txt, robot.yaml,
/// truth_trajectory.txt, summary.json and figures into the folder: all of them, or nothing. What stands there
/// of an older map, or under one of these names, stays beside the new ones (map.1.yaml, …). Cancelling leaves
/// the folder as it was: the error says so.
[[nodiscard]] Result<MapReport> map_recording(const MapJob& job, const JobControl& control);
/// The map of a lap whose recording holds poses of tags and no corners; nothing is written.
[[nodiscard]] Result<MapFile> map_poses(const RecordedLap& recorded, const MapJob& job, MapReport& report);
/// What `--json` prints and summary.json holds; the errors are null where the ground truth is unknown.
[[nodiscard]] ReportFields fields(const MapReport& report);
[[nodiscard]] ReportFields fields(const LoopClosure& loop);
/// What the verb `map` prints of a map that it wrote into this folder.
[[nodiscard]] std::string to_text(const MapReport& report, const std::string& folder);

}  // namespace waymark
