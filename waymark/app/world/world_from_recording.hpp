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

/// `waymark world from-recording`: a simulated place and robot with the statistics of a recorded drive.
namespace waymark {

struct WorldFromRecordingJob {
  std::string recording{};         ///< of the drive from which the map was made
  std::filesystem::path map{};     ///< folder that `waymark map` wrote
  std::filesystem::path folder{};  ///< of world.yaml, robot.yaml, camera.yaml; new or empty
  std::string robot{};             ///< file or name, for a map without robot.yaml

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.recording, JobField("recording RECORDING", "Recorded drive, in any format of `waymark info`")
                              .input()
                              .required());
    visit(self.map, JobField("map FOLDER", "Folder written by `waymark map` from this recording").required());
    visit(self.folder, JobField("output FOLDER", "New or empty folder to write").required());
    visit(self.robot,
          JobField("robot NAME",
                   "Robot that provides body and initial behaviour, by name or .yaml file. Unless "
                   "given: robot.yaml of the map"));
  }
};

/// One value estimated from the recording, and its key in the output file.
struct RecordedQuantity {
  std::string
      key{};  ///< "simulation.tag_camera.max_range_m" of robot.yaml, "camera.exposure_ms" of camera.yaml
  std::string words{};            ///< description, with its unit
  std::optional<double> value{};  ///< nothing: not determined by the recording
};

struct WorldFromRecordingReport {
  World world{};
  std::vector<RecordedQuantity> quantities{};
  std::vector<std::string> warnings{};
  std::vector<std::string> files{};  ///< what was written
};

/// Measures the drive against its map and writes the place (tags and route of the map, on a level floor at
/// z = 0), the robot (its file, with the rates, noises, scales, latency, detection range and turn response of
/// the recording in `simulation`; where the map knows what the odometry lacks, also that), and, where the
/// recording holds pictures whose blur tells them, exposure and lens (camera.yaml, options of the simulated
/// camera). Values that the recording does not determine keep those of the robot file. Fails on a map without
/// a trajectory, of several families, or of another recording (of another time, or with tags observed
/// elsewhere), and on a non-empty folder.
[[nodiscard]] Result<WorldFromRecordingReport> world_from_recording(const WorldFromRecordingJob& job,
                                                                    const JobControl& control);
[[nodiscard]] std::string to_text(const WorldFromRecordingReport& report,
                                  const std::filesystem::path& folder);
[[nodiscard]] ReportFields fields(const WorldFromRecordingReport& report);

}  // namespace waymark
