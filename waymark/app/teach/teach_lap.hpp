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

/// How fast people teach; a robot that cannot is driven as fast as it goes.
inline constexpr double kUsualSpeed_m_s = 0.3;

struct TeachJob {
  std::string output;                  ///< recording to write
  std::string driver = "scripted";     ///< of lap_drivers()
  double speed_m_s = kUsualSpeed_m_s;  ///< that the driver means to drive
  double second_speed_m_s = 0;         ///< another in turn with it (scripted); 0: none
  double wander_m = 0.02;              ///< how far off the line (scripted), standard deviation
  double wander_time_s = 3;            ///< and how long that lasts
  double overlap_m = 1;                ///< how far past the start a closed lap is driven (scripted)
  bool durable = false;                ///< also a power cut loses at most a second
  std::string images{};                ///< how pictures are recorded: raw, jpeg; empty: not at all
  LiveFeed* feed = nullptr;            ///< of viewers, if there are any

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.output,
          JobField("output FILE", "Recording to write (.mcap); never written over another").required());
    visit(self.driver,
          JobField("driver NAME", "Driver: scripted (follows the line of the world), keyboard or gamepad"));
    visit(self.speed_m_s,
          JobField("speed_m_s FLOAT",
                   "Cruising speed of the driver. Unless given: limited by the robot's maximum", 0.01, 5.0));
    visit(self.second_speed_m_s, JobField("second_speed_m_s FLOAT",
                                          "Second cruising speed, used alternately with the first every "
                                          "three metres: for `waymark calibrate robot`",
                                          0.01, 5.0)
                                     .less());
    visit(self.wander_m,
          JobField("wander_m FLOAT", "Standard deviation of the lateral deviation from the line", 0.0, 1.0)
              .grouped("Driver scripted"));
    visit(self.wander_time_s,
          JobField("wander_time_s FLOAT",
                   "Correlation time of the lateral deviation; short makes the path wind", 0.1, 60.0)
              .grouped("Driver scripted"));
    visit(self.overlap_m,
          JobField("overlap_m FLOAT", "Distance driven past the start of a closed lap", 0.0, 1000.0)
              .grouped("Driver scripted"));
    visit(self.images, JobField("record_images HOW",
                                "Also record the pictures (with `images`, or of a robot that sends them): "
                                "jpeg, or raw, ten times as large")
                           .one_of("jpeg,raw")
                           .less());
    visit(self.durable, JobField("durable", kDurableHelp).less());
  }
};

struct TeachReport {
  std::string file{};  ///< that was written
  TeachSummary summary{};
  LapEnd end{};
  double worst_blur_px = 0;  ///< by yaw rate, exposure and focal length
  int blurred_frames = 0;
  int abrupt_moments = 0;
  double wall_s = 0;
};

/// Fails on speeds that the robot does not drive or the driver does not change to, and on pictures to record
/// where there are none.
[[nodiscard]] Status check_teach(const TeachJob& job, const RobotSetup& setup);

/// Records a lap that somebody drives with the robot of the setup, simulated or a process. For a process,
/// "scripted" needs its world, and a robot that knows the truth. Cancelling stops the robot and closes the
/// file.
[[nodiscard]] Result<TeachReport> teach_lap(const RobotSetup& setup, const TeachJob& job,
                                            const JobControl& control);
/// What was driven and seen, and whether it can be mapped; `loop`: the route was to close.
[[nodiscard]] std::string to_text(const TeachReport& report, bool loop);
[[nodiscard]] ReportFields fields(const TeachReport& report);

/// Fails on flags of the script that drives a simulated robot, where it does not drive.
[[nodiscard]] Status check_effects(const TeachJob& job, const RobotSetup& setup, const GivenFields& given);

/// Records a lap as `images` says (raw, jpeg; empty: without pictures), with words to the control. All of
/// them outlive the listener.
[[nodiscard]] TeachListener lap_listener(SampleRecorder& recorder, const std::string& images,
                                         const JobControl& control);
/// A lap of the setup, for a listener.
[[nodiscard]] LapMonitor lap_of(const SimulatedSetup& setup, TeachListener listener);

}  // namespace waymark
