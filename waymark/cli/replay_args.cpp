#include "waymark/cli/replay_args.hpp"

#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/cli/file_names.hpp"
#include "waymark/cli/flags.hpp"

namespace waymark::cli {
namespace {

/// Flags that have no effect on this robot, or without a recording.
Status check_recording(const ReplayArgs& args, const RobotSetup& setup) {
  Status status = setup.process.empty() ? Status() : args.setup.refuse_seed();
  if (status && args.job.output.empty())
    status = refuse_flag(args.app, "--durable", "nothing is recorded", "Add -o FILE, or leave it out.");
  if (!status || args.job.images.empty()) return status;
  const Place place{.key = "--record-images"};
  if (args.job.output.empty())
    return fail(ErrorCode::InvalidArgument, "nothing is recorded", place, "Add -o FILE.");
  if (!setup.simulated.pictures && setup.process.empty())
    return fail(ErrorCode::InvalidArgument, "there are no pictures to record", place, "Add --images.");
  return {};
}

}  // namespace

Result<RobotSetup> ReplayArgs::make_setup() const {
  const std::filesystem::path beside = std::filesystem::path(folder) / "robot.yaml";
  std::error_code ignored;
  Result<RobotSetup> made = setup.make(std::filesystem::exists(beside, ignored) ? beside.string() : "");
  Status status = made ? pictures.apply(*made) : Status();
  if (made && status) status = check_recording(*this, *made);
  if (!status) return tl::unexpected(status.error());
  return made;
}

Result<ReplayJob> ReplayArgs::job_of(ReplayJob calibrated) const {
  calibrated.folder = folder;
  const Result<LocalizationKind> by = parse_replay_method(method);
  if (!by) return tl::unexpected(by.error());
  calibrated.method = *by;
  Result<ReplayController> steered_by = parse_controller(controller);
  if (!steered_by) {
    steered_by.error().place.key = "--controller";
    return tl::unexpected(std::move(steered_by.error()));
  }
  calibrated.replay.controller = *steered_by;
  if (!(calibrated.replay.laps > 0 && calibrated.replay.laps <= 1000))
    return fail(ErrorCode::InvalidArgument, fmt::format("{} is outside (0, 1000]", calibrated.replay.laps),
                {.key = "--laps"});
  if (Status status = options.apply(calibrated); !status) return tl::unexpected(status.error());
  return calibrated;
}

void ReplayArgs::add_to(CLI::App& verb) {
  add_option(verb, "MAP", folder, "Folder that `waymark map` wrote", kRequired);
  add_option(verb, "--method NAME", method,
             "Localisation method: riekf (right-invariant extended Kalman filter), ekf (extended Kalman "
             "filter) or anchor (nearest tag and odometry)",
             kShown);
  add_option(verb, "--controller NAME", controller,
             "Controller: follower (curvature feed-forward and error feedback), pursuit (pure pursuit) or "
             "pose (goal to goal)",
             kShown);
  add_option(
      verb, "--route NAME", job.route,
      "Name of the route to drive, of another lap (`waymark map --route-name`) or optimised (`waymark "
      "optimize`, which is judged by itself); `waymark routes` lists them. Unless given: the taught route");
  add_option(verb, "--calibration FILE", calibration,
             "Calibration of this robot (calibration.yaml); its yaw gain is the initial value that the "
             "follower learns from");
  add_option(verb, "--laps NUMBER", job.replay.laps, "Number of laps of a closed route", kShown);
  add_option(verb, "-o,--output FILE", job.output, "Recording to write of the replay (.mcap)")
      ->transform(recording_name());
  add_option(verb, "--record-images HOW", job.images,
             "With -o: also record the pictures (with --images, or of a robot that sends them): jpeg, or "
             "raw, ten times as large",
             one_of({"jpeg", "raw"}), kMore);
  add_flag(verb, "--durable", job.durable, kDurableHelp, kMore);
  add_option(verb, "--taught FILE", job.taught,
             "Recording of the lap to judge by. Unless given: truth_trajectory.txt of the folder", kMore);
  verb.add_flag("--json", json, "One JSON object instead of words");
}

}  // namespace waymark::cli
