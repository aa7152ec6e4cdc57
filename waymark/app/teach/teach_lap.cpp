#include "waymark/app/teach/teach_lap.hpp"

#include <fmt/format.h>

#include "waymark/app/live/inputs.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/teach/lap_recording.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/robots/simulated/script_driver.hpp"
#include "waymark/runtime/teach_session.hpp"

namespace waymark {
namespace {

/// What a recording says of how it was driven and seen.
std::string making_yaml(const SimulatedSetup& setup, const TeachJob& job, const DriverOptions& driver) {
  std::string yaml =
      "driver:\n" +
      (job.driver == "scripted" ? write_fields(driver, 2) : fmt::format("  speed_m_s: {}\n", job.speed_m_s));
  if (setup.pictures)
    yaml += "camera:\n" + write_fields(setup.pictures->camera, 2) + "scene:\n" +
            write_fields(setup.pictures->scene, 2) + "detector:\n" +
            write_fields(setup.pictures->detector, 2);
  return yaml;
}

/// Who drives a simulated lap: a person by the clock on the wall, or a script that sees the robot.
struct SimulatedDriver {
  std::unique_ptr<LapDriver> driver{};
  ScriptDriver* script = nullptr;
};

Result<SimulatedDriver> driver_of(const SimulatedSetup& setup, const TeachJob& job,
                                  const DriverOptions& options) {
  if (job.driver != "scripted") {
    auto person = make_lap_driver(job.driver, job.speed_m_s, setup);
    if (!person) return tl::unexpected(person.error());
    return SimulatedDriver{.driver = std::move(*person)};
  }
  auto scripted = scripted_driver(setup, options);
  if (!scripted) return tl::unexpected(scripted.error());
  auto script = std::make_unique<ScriptDriver>(std::move(*scripted));
  ScriptDriver* const sees = script.get();
  return SimulatedDriver{.driver = std::move(script), .script = sees};
}

Result<LapEnd> drive(const SimulatedSetup& setup, const SimulatedDriver& driver, TeachSession& session,
                     const LapListener& listener) {
  constexpr double kTenMinutes = 600;
  constexpr double kAnHour = 3600;
  return drive_lap(
      setup,
      [&](const SE2& map_T_base, Duration uptime, SensorTime now) {
        if (driver.script != nullptr) driver.script->see(map_T_base);
        return session.decide(uptime, now);
      },
      listener, driver.script != nullptr ? kTenMinutes : kAnHour);
}

Result<TeachReport> teach_simulated(const RobotSetup& setup, const TeachJob& job, const JobControl& control) {
  const Stopwatch watch;
  const SimulatedSetup& simulated = setup.simulated;
  const DriverOptions driver{.speed_m_s = job.speed_m_s,
                             .second_speed_m_s = job.second_speed_m_s,
                             .lateral_wander_m = job.wander_m,
                             .wander_time_s = job.wander_time_s,
                             .overlap_m = job.overlap_m};
  const auto who = driver_of(simulated, job, driver);
  if (!who) return tl::unexpected(who.error());
  Result<SampleRecorder> recorder = start_recording(job.output,
                                                    {.verb = "teach",
                                                     .driver = job.driver,
                                                     .options = making_yaml(simulated, job, driver),
                                                     .durable = job.durable},
                                                    setup);
  if (!recorder) return tl::unexpected(recorder.error());
  TeachSession session(*who->driver, lap_of(simulated, lap_listener(*recorder, job.images, control)));
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) { return session.receive(sample); };
  listener.on_picture = [&](const SeenPicture& seen) { return record_rendered(seen, job.images, *recorder); };
  listener.should_stop = control.cancelled;
  if (const std::string usage = who->driver->usage(); !usage.empty()) control.note(usage);
  const auto end = drive(simulated, *who, session, listener);
  const Status closed = recorder->close();
  if (!end) return tl::unexpected(end.error());
  if (!closed) return tl::unexpected(closed.error());
  return report_of(session.lap(), *end, watch);
}

}  // namespace

Status check_teach(const TeachJob& job, const RobotSetup& setup) {
  const RobotModel& robot = setup.simulated.model;
  const double most = robot.limits.speed_m_s;
  if (job.speed_m_s > most)
    return fail(ErrorCode::InvalidArgument, fmt::format("{} drives at most {:g} m/s", robot.name, most),
                {.key = "--speed-m-s"},
                "Give a lower speed, or change limits: speed_m_s in a robot's file of your own.");
  if (job.second_speed_m_s > most)
    return fail(ErrorCode::InvalidArgument, fmt::format("{} drives at most {:g} m/s", robot.name, most),
                {.key = "--second-speed-m-s"}, "Give a lower speed.");
  if (job.second_speed_m_s > 0 && (job.driver != "scripted" || !setup.process.empty()))
    return fail(ErrorCode::InvalidArgument,
                "only the scripted driver of a simulated robot changes its speed by itself",
                {.key = "--second-speed-m-s"}, "Leave it out, and drive at two speeds.");
  return check_recorded_images(setup.may_have_pictures(), job.images);
}

Result<TeachReport> teach_lap(const RobotSetup& setup, const TeachJob& job, const JobControl& control) {
  return setup.process.empty() ? teach_simulated(setup, job, control) : teach_process(setup, job, control);
}

Status check_effects(const TeachJob& job, const RobotSetup& setup, const GivenFlags& given) {
  const bool process = !setup.process.empty();
  FlagRefusals refused(given);
  refused.flags(process || job.driver != "scripted", {"--wander-m", "--wander-time-s", "--overlap-m"},
                "this is about the scripted driver of a simulated robot", "Leave it out.");
  refuse_seed(process && job.driver != "scripted", refused);
  return refused.status();
}

}  // namespace waymark
