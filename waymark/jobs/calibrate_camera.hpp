#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/jobs/detect_all.hpp"
#include "waymark/jobs/video_views.hpp"
#include "waymark/mapping/calibration/camera_calibration.hpp"

/// `waymark calibrate camera`: the intrinsics of a camera from pictures of a printed board.
namespace waymark {

struct CalibrateCameraJob {
  std::vector<std::string> sources{};  ///< pictures of the board …
  bool recursive = false;
  std::string detections{};  ///< … or what `waymark detect --json --covariance` wrote; -: standard input
  int columns = 0;           ///< of the board
  int rows = 0;
  double tag_size_m = 0;
  double spacing = 0.3;  ///< gap between two tags, as a share of their size
  int first_id = 0;      ///< of the lower left tag
  std::string map{};     ///< instead of a board
  std::string lens = "auto";
  std::string output{};       ///< calibration.yaml; empty: none
  std::string camera_info{};  ///< the camera as ROS writes it; empty: none
  CameraCalibrationOptions options{};
  VideoViewOptions views{};  ///< which pictures of a video count
};

struct CalibrateCameraReport {
  CameraCalibration found;
  std::vector<std::string> pictures{};  ///< that were used, as found.views
};

/// What is calibrated on: the job's board or map. InvalidArgument: what the job says of the board makes none.
[[nodiscard]] Result<TagMap> calibration_target(const CalibrateCameraJob& job);
/// Fails when an output of the job cannot be written, before anything is read.
[[nodiscard]] Status check_outputs(const CalibrateCameraJob& job);

/// Finds the tags with the finder, where pictures are given, and fits the camera.
[[nodiscard]] Result<CalibrateCameraReport> calibrate_camera(const CalibrateCameraJob& job,
                                                             const TagMap& target, const TagFinder& finder,
                                                             const JobControl& control);
[[nodiscard]] Status write_camera_calibration(const CalibrateCameraJob& job,
                                              const CalibrateCameraReport& report);
/// Standard deviation of a parameter.
[[nodiscard]] double sigma_of(const CameraCalibration& found, std::size_t parameter);
/// The contract of `waymark calibrate camera --json` (docs/reference/cli.md).
[[nodiscard]] nlohmann::ordered_json to_json(const CalibrateCameraReport& report);

}  // namespace waymark
