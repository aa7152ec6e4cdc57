#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/simulation/world/world.hpp"

/// `waymark world from-recording`: creates a simulated world and robot with the statistics of a recorded
/// drive.
namespace waymark {

struct WorldFromRecordingJob {
  std::string recording{};         ///< recording from which the map was made
  std::filesystem::path map{};     ///< folder written by `waymark map`
  std::filesystem::path folder{};  ///< new or empty folder for world.yaml, robot.yaml and camera.yaml
  std::string robot{};             ///< name or .yaml file; if empty, the robot.yaml of the map

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.recording,
          JobField("recording RECORDING", "Recorded drive, in any format supported by `waymark info`")
              .input()
              .required());
    visit(self.map, JobField("map FOLDER", "Folder written by `waymark map` from this recording").required());
    visit(self.folder, JobField("output FOLDER", "New or empty folder to write").required());
    visit(self.robot, JobField("robot NAME",
                               "Robot that provides the body and the initial simulation options: a name, or "
                               "a .yaml file. Default: robot.yaml of the map"));
  }
};

/// A value estimated from the recording, and its key in the output file.
struct RecordedQuantity {
  /// For example "simulation.tag_camera.max_range_m" in robot.yaml, or "camera.exposure_ms" in camera.yaml.
  std::string key{};
  std::string text{};             ///< description, including the unit
  std::optional<double> value{};  ///< empty if the recording does not determine it
};

struct WorldFromRecordingReport {
  World world{};
  std::vector<RecordedQuantity> quantities{};
  std::vector<std::string> warnings{};
  std::vector<std::string> files{};  ///< names of the files in the folder
};

/// Measures the properties of a drive, using its map, and writes up to three files:
/// - world.yaml: the tags and the route from the map, on a level floor at z = 0;
/// - robot.yaml: the robot, where `simulation` contains the rates, noises, scales, latency, detection range
///   and turn response from the recording, and odometry errors if the map contains an odometry calibration;
/// - camera.yaml: exposure and lens blur of the simulated camera, if blurred images determine them.
/// Values that the recording does not determine are taken from the robot file. Fails if the folder is not
/// empty, or if the map has no trajectory, contains several families, or was made from a different recording
/// (different time, or inconsistent tags).
[[nodiscard]] Result<WorldFromRecordingReport> world_from_recording(const WorldFromRecordingJob& job,
                                                                    const JobControl& control);
[[nodiscard]] std::string to_text(const WorldFromRecordingReport& report,
                                  const std::filesystem::path& folder);
[[nodiscard]] ReportFields fields(const WorldFromRecordingReport& report);

}  // namespace waymark
