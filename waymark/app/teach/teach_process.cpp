#include <fmt/format.h>

#include "waymark/app/common/output_files.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/live/session_viewers.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/teach/lap_recording.hpp"
#include "waymark/app/teach/teach_lap.hpp"
#include "waymark/runtime/teach_session.hpp"

namespace waymark {

Result<TeachReport> teach_process(const RobotSetup& setup, const TeachJob& job, const JobControl& control) {
  const Stopwatch watch;
  const auto driver = make_lap_driver(job.driver, job.speed_m_s, setup.simulated);
  if (!driver) return tl::unexpected(driver.error());
  // Before the robot starts: a file that cannot be written should not cost a drive.
  Result<SampleRecorder> recorder =
      start_recording(job.output,
                      {.verb = "teach",
                       .driver = job.driver,
                       .options = fmt::format("driver:\n  speed_m_s: {}\n", job.speed_m_s),
                       .durable = job.durable},
                      setup);
  if (!recorder) return tl::unexpected(recorder.error());
  FreshFile fresh(job.output);
  const auto robot = LiveRobot::open(setup, control);
  if (!robot) return tl::unexpected(robot.error());
  PhaseViewers viewers(job.feed, setup.simulated, OperatorState::Teaching, job.driver == "keyboard");
  TeachSession session(**driver, lap_of(setup.simulated, lap_listener(*recorder, job.images, control)),
                       viewers.requests(), {.silence_s = 2});
  RobotListener listener = session.listener();
  listener.on_sample = [&](const Sample& sample) {
    fresh.receive(sample);
    return session.receive(sample);
  };
  if (const std::string usage = (*driver)->usage(); !usage.empty()) control.note(usage);
  const auto driven = (*robot)->drive(watched(std::move(listener), job.feed, control));
  const Status closed = recorder->close();  // also of a lap that ended badly: what was driven is kept
  const bool hung_up = !driven && control.cancelled();  // the terminal went, and the keys with it
  if (!driven && driven.error().place.key == "--driver") fresh.discard();  // it cannot drive this robot
  if (!driven && !hung_up) return tl::unexpected(driven.error());
  fresh.keep();
  if (!closed) return tl::unexpected(closed.error());
  const LapEnd end =
      hung_up ? LapEnd{.finished = session.finished(), .interrupted = true} : session.end(*driven);
  return report_of(session.lap(), end, watch);
}

}  // namespace waymark
