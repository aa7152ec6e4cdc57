#pragma once

#include <string>

#include "waymark/app/common/field_refusals.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/robots/simulated/detecting_camera.hpp"
#include "waymark/runtime/teach_session.hpp"

namespace waymark {

class LiveFeed;

/// Default speed for teaching a lap. Slower robots are driven at their maximum speed.
inline constexpr double kUsualSpeed_m_s = 0.3;

struct TeachJob {
  std::string output;                  ///< path of the recording to write
  std::string driver = "scripted";     ///< a name from lap_drivers()
  double speed_m_s = kUsualSpeed_m_s;  ///< cruising speed of the driver
  double second_speed_m_s = 0;         ///< alternates with speed_m_s (scripted); not used if 0
  double wander_m = 0.02;              ///< standard deviation of the lateral deviation (scripted)
  double wander_time_s = 3;            ///< correlation time of the lateral deviation
  double overlap_m = 1;                ///< distance driven beyond the start of a closed lap (scripted)
  bool durable = false;                ///< whether to sync every second, so that a power cut loses at most
                                       ///< one second
  std::string images{};                ///< format of recorded images (raw, jpeg); they are not recorded if
                                       ///< empty
  LiveFeed* feed = nullptr;            ///< feed for viewers; may be nullptr

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.output, JobField("output FILE", "Recording to write (.mcap); must not exist").required());
    visit(self.driver,
          JobField("driver NAME", "Driver: scripted (follows the path of the world), keyboard or gamepad"));
    visit(self.speed_m_s,
          JobField("speed_m_s FLOAT",
                   "Cruising speed of the driver. The default is limited by the robot's maximum", 0.01, 5.0));
    visit(self.second_speed_m_s, JobField("second_speed_m_s FLOAT",
                                          "Second cruising speed, used alternately with the first every "
                                          "three metres: for `waymark calibrate robot`",
                                          0.01, 5.0)
                                     .less());
    visit(self.wander_m,
          JobField("wander_m FLOAT", "Standard deviation of the lateral deviation from the path", 0.0, 1.0)
              .grouped("Driver scripted"));
    visit(self.wander_time_s,
          JobField("wander_time_s FLOAT",
                   "Correlation time of the lateral deviation; a short one makes the path winding", 0.1, 60.0)
              .grouped("Driver scripted"));
    visit(self.overlap_m,
          JobField("overlap_m FLOAT", "Distance driven past the start of a closed lap", 0.0, 1000.0)
              .grouped("Driver scripted"));
    visit(self.images, JobField("record_images HOW",
                                "Also record the images (with `images`, or of a robot that sends them): "
                                "jpeg, or raw, ten times as large")
                           .one_of("jpeg,raw")
                           .less());
    visit(self.durable, JobField("durable", kDurableHelp).less());
  }
};

struct TeachReport {
  std::string file{};  ///< path of the recording
  TeachSummary summary{};
  LapEnd end{};
  double worst_blur_px = 0;  ///< computed from yaw rate, exposure time and focal length
  int blurred_frames = 0;
  int abrupt_moments = 0;
  double wall_s = 0;
};

/// Fails if a speed exceeds the limit of the robot, or if images should be recorded but there are none. Fails
/// also if a second speed is set without the scripted driver of a simulated robot.
[[nodiscard]] Status check_teach(const TeachJob& job, const RobotSetup& setup);

/// Records a lap with the robot of the setup, which is either simulated or a process. For a process,
/// "scripted" requires the world and a robot that sends ground truth. Cancelling stops the robot and closes
/// the file.
[[nodiscard]] Result<TeachReport> teach_lap(const RobotSetup& setup, const TeachJob& job,
                                            const JobControl& control);
/// Distance, frames, detections, and whether the lap can be mapped. `loop` is true if the route should be
/// closed.
[[nodiscard]] std::string to_text(const TeachReport& report, bool loop);
[[nodiscard]] ReportFields fields(const TeachReport& report);

/// Fails if fields for the scripted driver of a simulated robot are set, but another driver or robot is used.
[[nodiscard]] Status check_effects(const TeachJob& job, const RobotSetup& setup, const GivenFields& given);

/// A listener that records a lap and passes texts to the control. Images are recorded in the format `images`
/// (raw, jpeg; none are recorded if empty). All arguments must outlive the listener.
[[nodiscard]] TeachListener lap_listener(SampleRecorder& recorder, const std::string& images,
                                         const JobControl& control);
/// The lap to be taught with this setup, for lap_listener().
[[nodiscard]] LapMonitor lap_of(const SimulatedSetup& setup, TeachListener listener);

}  // namespace waymark
