#include "waymark/cli/teach_flags.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/base/suggest.hpp"
#include "waymark/cli/file_names.hpp"
#include "waymark/cli/flags.hpp"
#include "waymark/live/start_recording.hpp"

namespace waymark::cli {
namespace {

/// Flags of the script that drives a simulated robot.
Status check_script_flags(const TeachArgs& args, const RobotSetup& setup) {
  Status status;
  for (const char* flag : {"--wander-m", "--wander-time-s", "--overlap-m"}) {
    if (status && (args.job.driver != "scripted" || !setup.process.empty()))
      status = refuse_flag(args.app, flag, "this is about the scripted driver of a simulated robot",
                           "Leave it out.");
  }
  if (status && args.job.driver != "scripted" && !setup.process.empty()) status = args.setup.refuse_seed();
  return status;
}

Status check_speeds(const TeachArgs& args, const RobotSetup& setup) {
  const double most = setup.simulated.model.limits.speed_m_s;
  if (args.speed->count() > 0 && args.job.speed_m_s > most)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} drives at most {:g} m/s", setup.simulated.model.name, most),
                {.key = "--speed-m-s"},
                "Give a lower speed, or change limits: speed_m_s in a robot's file of your own.");
  if (args.job.second_speed_m_s > most)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} drives at most {:g} m/s", setup.simulated.model.name, most),
                {.key = "--second-speed-m-s"}, "Give a lower speed.");
  if (args.job.second_speed_m_s > 0 && (args.job.driver != "scripted" || !setup.process.empty()))
    return fail(ErrorCode::InvalidArgument,
                "only the scripted driver of a simulated robot changes its speed by itself",
                {.key = "--second-speed-m-s"}, "Leave it out, and drive at two speeds.");
  return {};
}

Status check_driver(const TeachJob& job) {
  const std::vector<std::string> drivers = lap_drivers();
  if (std::ranges::find(drivers, job.driver) != drivers.end()) return {};
  return fail(ErrorCode::InvalidArgument, fmt::format("there is no driver '{}'", job.driver),
              {.key = "--driver"}, suggestion(job.driver, drivers));
}

}  // namespace

Result<RobotSetup> TeachArgs::make_setup() const {
  if (Status known = check_driver(job); !known) return tl::unexpected(known.error());
  Result<RobotSetup> made = setup.make();
  Status status = made ? pictures.apply(*made) : Status();
  if (made && status) status = place_lone_anchor(*made, anchor);
  if (!status) return tl::unexpected(status.error());
  return made;
}

TeachJob TeachArgs::job_of(const RobotSetup& on) const {
  TeachJob made = job;
  if (speed->count() == 0) made.speed_m_s = std::min(made.speed_m_s, on.simulated.model.limits.speed_m_s);
  return made;
}

Status TeachArgs::check(const RobotSetup& on) const {
  Status status = check_speeds(*this, on);
  if (status) status = check_script_flags(*this, on);
  if (!status || job.images.empty() || on.simulated.pictures || !on.process.empty()) return status;
  return fail(ErrorCode::InvalidArgument, "there are no pictures to record", {.key = "--record-images"},
              "Add --images.");
}

void TeachArgs::add_to(CLI::App& verb) {
  add_option(verb, "-o,--output FILE", job.output, "Recording to write (.mcap); never written over another",
             kRequired)
      ->transform(recording_name());
  add_option(verb, "--driver NAME", job.driver,
             "Driver: scripted (follows the line of the world), keyboard or gamepad", kShown);
  speed = add_option(verb, "--speed-m-s FLOAT", job.speed_m_s,
                     "Cruising speed of the driver. Unless given: limited by the robot's maximum", kShown,
                     between(0.01, 5.0));
  add_option(verb, "--second-speed-m-s FLOAT", job.second_speed_m_s,
             "Second cruising speed, used alternately with the first every three metres: for `waymark "
             "calibrate robot`",
             between(0.01, 5.0), kMore);
  const char* scripted = "Driver scripted";
  add_option(verb, "--wander-m FLOAT", job.wander_m,
             "Standard deviation of the lateral deviation from the line", kShown, between(0.0, 1.0),
             in_group(scripted));
  add_option(verb, "--wander-time-s FLOAT", job.wander_time_s,
             "Correlation time of the lateral deviation; short makes the path wind", kShown,
             between(0.1, 60.0), in_group(scripted));
  add_option(verb, "--overlap-m FLOAT", job.overlap_m, "Distance driven past the start of a closed lap",
             kShown, between(0.0, 1000.0), in_group(scripted));
  add_option(verb, "--record-images HOW", job.images,
             "Also record the pictures (with --images, or of a robot that sends them): jpeg, or raw, ten "
             "times as large",
             one_of({"jpeg", "raw"}), kMore);
  add_flags(verb, anchor);
  add_flag(verb, "--durable", job.durable, kDurableHelp, kMore);
  verb.add_flag("--json", json, "One JSON object instead of words");
}

}  // namespace waymark::cli
