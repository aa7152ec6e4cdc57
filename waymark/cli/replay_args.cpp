#include "waymark/cli/replay_args.hpp"

#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include "waymark/cli/file_names.hpp"

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
  verb.add_option("MAP", folder, "Folder that `waymark map` wrote")->required()->type_name("");
  verb.add_option("--method", method,
                  "Localisation method: riekf (right-invariant extended Kalman filter), ekf (extended Kalman "
                  "filter) or anchor (nearest tag and odometry)")
      ->capture_default_str()
      ->type_name("NAME");
  verb.add_option("--controller", controller,
                  "Controller: follower (curvature feed-forward and error feedback), pursuit (pure pursuit) "
                  "or pose (goal to goal)")
      ->capture_default_str()
      ->type_name("NAME");
  verb.add_option(
          "--route", job.route,
          "Name of the route to drive, of another lap (`waymark map --route-name`) or optimised (`waymark "
          "optimize`, which is judged by itself); `waymark routes` lists them. Unless given: the taught "
          "route")
      ->type_name("NAME");
  verb.add_option("--calibration", calibration,
                  "Calibration of this robot (calibration.yaml); its yaw gain is the initial value that the "
                  "follower learns from")
      ->type_name("FILE");
  verb.add_option("--laps", job.replay.laps, "Number of laps of a closed route")
      ->capture_default_str()
      ->type_name("NUMBER");
  verb.add_option("-o,--output", job.output, "Recording to write of the replay (.mcap)")
      ->transform(recording_name())
      ->type_name("FILE");
  verb.add_option(
          "--record-images", job.images,
          "With -o: also record the pictures (with --images, or of a robot that sends them): jpeg, or "
          "raw, ten times as large")
      ->check(CLI::IsMember({"jpeg", "raw"}))
      ->type_name("HOW")
      ->group(kMoreGroup);
  verb.add_flag("--durable", job.durable, kDurableHelp)->group(kMoreGroup);
  verb.add_option("--taught", job.taught,
                  "Recording of the lap to judge by. Unless given: truth_trajectory.txt of the folder")
      ->type_name("FILE")
      ->group(kMoreGroup);
  verb.add_flag("--json", json, "One JSON object instead of words");
}

}  // namespace waymark::cli
