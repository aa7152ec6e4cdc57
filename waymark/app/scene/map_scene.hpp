#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/changed_tag_fields.hpp"
#include "waymark/app/common/duplicate_tag_fields.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/common/thin_cut_fields.hpp"
#include "waymark/app/common/wrong_size_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/mapping/scene/scene_values.hpp"

/// `waymark map scene`: maps scenes with cameras and bodies that are described by TagSLAM files.
namespace waymark {

struct MapSceneJob {
  std::string recording{};
  std::filesystem::path tagslam{};  ///< folder with the TagSLAM files
  std::filesystem::path folder{};   ///< the output folder
  std::filesystem::path against{};  ///< folder with another solution to compare with; empty if there is none
  SceneMapOptions options{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.recording, JobField("recording RECORDING",
                                   "Recording (bag or MCAP) with tag detections and, if available, odometry")
                              .input()
                              .required());
    visit(self.tagslam,
          JobField("tagslam FOLDER",
                   "Folder with TagSLAM's tagslam.yaml, cameras.yaml and camera_poses.yaml (or a "
                   "config.json), which describe cameras and bodies")
              .required());
    visit(self.folder, JobField("output FOLDER", "Folder for the map and the trajectories").required());
    visit(self.options.free_intrinsics,
          JobField("free_intrinsics",
                   "Estimate the intrinsics as well. Standard deviations from the given values: 1 % for "
                   "focal lengths and principal point, 0.05 for distortion k, and 0.005 for p"));
    visit(self.against, JobField("against FOLDER",
                                 "Folder with another solution (ref_static.csv, ref_trajectory.csv) whose "
                                 "cost is printed; both solutions then use only its frames and tags"));
  }
};

/// Parses "waymark" or "tagslam". Errors name the field `model`.
[[nodiscard]] Result<SceneModel> parse_scene_model(const std::string& name);
/// Fails if fields contradict each other.
[[nodiscard]] Status check(const MapSceneJob& job);

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

/// Maps the recording, and writes map.yaml (tags on static bodies), poses.yaml and camera_poses.yaml (in
/// TagSLAM's format), trajectory_BODY.txt for each moving body, and summary.json. Writes nothing if no map
/// can be made.
[[nodiscard]] Result<MapSceneReport> map_scene_recording(const MapSceneJob& job, const JobControl& control);
/// The content of `--json` and summary.json.
[[nodiscard]] ReportFields fields(const MapSceneReport& report);
[[nodiscard]] ReportFields fields(const OdometryLink& link);
[[nodiscard]] ReportFields fields(const RejectedOdometry& rejected);
[[nodiscard]] ReportFields fields(const CostAtValues& cost);
/// The printed report for a map in this folder.
[[nodiscard]] std::string to_text(const MapSceneReport& report, const std::string& folder);

}  // namespace waymark
