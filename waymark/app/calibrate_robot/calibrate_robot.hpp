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

/// `waymark calibrate robot`: estimates camera mounting, scales, gains and latency from a drive past tags.
namespace waymark {

enum class CalibrateRobotBy : std::uint8_t {
  Either,       ///< Lap if can_calibrate_by_lap() is true, otherwise Innovations
  Lap,          ///< estimates tags, trajectory and parameters jointly by bundle adjustment
  Innovations,  ///< finds the parameters that minimise the filter innovations; requires a map
};

struct CalibrateRobotJob {
  /// Recordings, map, robot, earlier calibration and filter. `output` is the path of the new calibration.
  LocalizeJob drive{};
  CalibrateRobotBy by = CalibrateRobotBy::Either;
  double from_s = 0;  ///< start of the interval to use, relative to the first sample; to_s is its end
  double to_s = std::numeric_limits<double>::infinity();
};

/// User options for a calibration.
struct CalibrateRobotRequest {
  CalibrateRobotJob job{};
  std::string by{};  ///< "lap" or "innovations"; if empty, either

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.job.drive.logs, JobField("logs LOG", "Recordings of one drive past tags").input().required());
    visit(self.job.drive.map, JobField("map FILE",
                                       "Tag map, as for `waymark localize`. By default, the tags are "
                                       "estimated together with the calibration"));
    visit(self.by,
          JobField("by HOW",
                   "Method: lap (bundle adjustment of tags, trajectory and calibration) or innovations "
                   "(maximum likelihood of the filter's innovations). Default: lap if the recording has tag "
                   "corners and odometry, and the map, if any, is a Waymark map")
              .one_of("lap,innovations"));
    CameraChoice::fields(self.job.drive.frames, visit);
    visit(self.job.drive.robot,
          JobField("robot FILE", "Initial camera and its mounting: a robot file, or a name"));
    visit(self.job.drive.calibration,
          JobField("calibration FILE", "Known calibration (calibration.yaml), such as that of the camera"));
    visit(self.job.drive.tag_size_m, JobField("tag_size_m NUMBER", "Tag size if the map contains none"));
    visit(self.job.drive.map_sigma_m, JobField("map_sigma NUMBER",
                                               "Method lap: standard deviation of the tag positions in a map "
                                               "without covariances, such as one measured by hand [m]",
                                               1e-6, 10.0));
    visit(self.job.drive.sensor_pose,
          JobField("sensor_pose NUMBER", "Mounting of the range sensor on the robot: x y [m], yaw [deg]")
              .parts(3));
    visit(self.job.from_s,
          JobField("from S", "Start of the interval to use, in seconds from the start of the recording"));
    visit(self.job.to_s,
          JobField("to S", "End of the interval to use, in seconds from the start of the recording")
              .without_default());
    visit(self.job.drive.output, JobField("output FILE", "Calibration to write (calibration.yaml)"));
  }
};

struct CalibrateRobotReport {
  Calibration calibration{};
  std::optional<LapCalibration> lap{};         ///< set by the lap method
  std::optional<InnovationFit> innovations{};  ///< set by the innovations method
  std::vector<std::string> warnings{};
};

/// Whether the lap method is possible. With a map, this requires a Waymark map and a recording that contains
/// tag corners and odometry. Without a map, the result is always true, because the innovations method
/// requires a map; the recording is then not read.
[[nodiscard]] bool can_calibrate_by_lap(const LocalizeJob& job, const JobControl& control);

/// Reads the part of the job's recording between two times, relative to its first frame with tags, and
/// estimates the map and the calibration jointly. Uses the job's logs, robot, calibration, tag_size_m and, if
/// set, map.
[[nodiscard]] Result<LapCalibration> calibrate_recorded_lap(const LocalizeJob& job, double from_s,
                                                            double to_s, const JobControl& control);

/// Estimates the calibration, but writes nothing. If the output cannot be written, fails before reading any
/// input.
[[nodiscard]] Result<CalibrateRobotReport> calibrate_robot(const CalibrateRobotJob& job,
                                                           const JobControl& control);
/// Writes the calibration to the job's output, if set. If a file already exists, it is renamed, and its new
/// name is returned; otherwise the returned string is empty. Fails without writing anything if the drive
/// determines no value, or if the estimated values fit no better than the given ones.
[[nodiscard]] Result<std::string> write_robot_calibration(const CalibrateRobotJob& job,
                                                          const CalibrateRobotReport& report);
[[nodiscard]] ReportFields fields(const CalibrateRobotReport& report);

/// One line per value, with its standard deviation or with advice on how to drive.
[[nodiscard]] std::string to_text(const CalibrateRobotReport& report);

}  // namespace waymark
