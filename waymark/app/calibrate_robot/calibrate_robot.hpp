#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/localize/localize_log.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/localization/innovation_fits.hpp"
#include "waymark/mapping/lap/lap_calibration.hpp"

/// `waymark calibrate robot`: camera mounting, scales, gains and latency from a drive past tags.
namespace waymark {

enum class CalibrateRobotBy : std::uint8_t {
  Either,       ///< the lap, if it contains the required data
  Lap,          ///< tags, trajectory and parameters jointly, by bundle adjustment
  Innovations,  ///< the parameters with the smallest filter innovations; needs a map
};

struct CalibrateRobotJob {
  LocalizeJob drive{};  ///< recordings, map, robot, earlier calibration, filter; `output`: calibration.yaml
  CalibrateRobotBy by = CalibrateRobotBy::Either;
  double from_s = 0;  ///< of the drive, after its first sample
  double to_s = std::numeric_limits<double>::infinity();
};

/// User input of a calibration, without options.
struct CalibrateRobotRequest {
  CalibrateRobotJob job{};
  std::string by{};  ///< lap, innovations; empty: either

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.job.drive.logs, JobField("logs LOG", "Recordings of one drive past tags").input().required());
    visit(self.job.drive.map, JobField("map FILE",
                                       "Tag map, as for `waymark localize`. Unless given: the tags are "
                                       "mapped together with the calibration"));
    visit(self.by,
          JobField("by HOW",
                   "Calibration method: lap (bundle adjustment of tags, trajectory and calibration, with the "
                   "map's covariance) or innovations (likelihood of the filter's innovations). Unless given: "
                   "lap if there are tag corners and odometry, and no map or one by Waymark")
              .one_of("lap,innovations"));
    CameraChoice::fields(self.job.drive.frames, visit);
    visit(self.job.drive.robot,
          JobField("robot FILE", "Camera and its mounting, as far as known: a robot file, or a name"));
    visit(self.job.drive.calibration,
          JobField("calibration FILE", "Known calibration (calibration.yaml), such as the camera's"));
    visit(self.job.drive.tag_size_m, JobField("tag_size_m NUMBER", "Tag size if the map has none"));
    visit(self.job.drive.map_sigma_m, JobField("map_sigma NUMBER",
                                               "Standard deviation of the tags' positions, by lap, of a map "
                                               "without covariances, such as one measured by hand [m]",
                                               1e-6, 10.0));
    visit(self.job.drive.sensor_pose,
          JobField("sensor_pose NUMBER", "Mounting of the range sensor on the robot: x y [m], yaw [deg]")
              .parts(3));
    visit(self.job.from_s, JobField("from S", "Start of the used interval, in seconds from the start"));
    visit(self.job.to_s,
          JobField("to S", "End of the used interval, in seconds from the start").without_default());
    visit(self.job.drive.output, JobField("output FILE", "Calibration to write (calibration.yaml)"));
  }
};

struct CalibrateRobotReport {
  Calibration calibration{};
  std::optional<LapCalibration> lap{};         ///< when it was found by the lap
  std::optional<InnovationFit> innovations{};  ///< when it was found by innovations
  std::vector<std::string> warnings{};
};

/// Whether the recording contains tag corners and odometry, and the map of the job, if it
/// names one, is a Waymark map.
[[nodiscard]] bool can_calibrate_by_lap(const LocalizeJob& job, const JobControl& control);

/// Reads the recording of the job (logs, robot, calibration, tag_size_m, and the map as far as it is known)
/// between two times after its first frame, and finds map and calibration together.
[[nodiscard]] Result<LapCalibration> calibrate_recorded_lap(const LocalizeJob& job, double from_s,
                                                            double to_s, const JobControl& control);

/// Fails before anything is read if the output cannot be written.
[[nodiscard]] Result<CalibrateRobotReport> calibrate_robot(const CalibrateRobotJob& job,
                                                           const JobControl& control);
/// Writes the calibration to the job's output, if it names one; an existing file becomes a backup, whose name
/// is returned. Fails, and writes nothing, if the drive
/// determines no value, or none better than the given ones.
[[nodiscard]] Result<std::string> write_robot_calibration(const CalibrateRobotJob& job,
                                                          const CalibrateRobotReport& report);
[[nodiscard]] ReportFields fields(const CalibrateRobotReport& report);

/// One line per value with its standard deviation, or advice on what to drive.
[[nodiscard]] std::string to_text(const CalibrateRobotReport& report);

}  // namespace waymark
