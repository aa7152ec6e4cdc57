#include "waymark/app/calibrate_robot/calibrate_lap.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "waymark/app/common/robot_setup.hpp"
#include "waymark/app/map/map_steps.hpp"
#include "waymark/config/calibration_file.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/mapping/lap/map_checks.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// What a robot's file and an earlier calibration say of the camera counts for more than the recording.
Status believe_files(const LocalizeJob& job, RecordingSetup& setup, const JobControl& control) {
  std::vector<std::string> warnings;
  if (Status status = take_robot(job.robot, setup, warnings); !status) return status;
  for (const std::string& words : warnings) control.note("warning: " + words);
  if (job.calibration.empty()) return {};
  const Result<Calibration> calibration = read_calibration(job.calibration);
  if (!calibration) return tl::unexpected(calibration.error());
  if (calibration->camera) setup.camera = calibration->camera;
  if (setup.base_T_cam) setup.base_T_cam = calibrated_mounting(*setup.base_T_cam, *calibration);
  return {};
}

/// Where no anchor is named any does: nobody asks where the map stands.
SetupOverrides overrides_of(const LocalizeJob& job, const RecordedLap& recorded) {
  SetupOverrides overrides{.tag_size_m = job.tag_size_m};
  if (setup_of(recorded, overrides)) return overrides;
  std::map<TagId, int> seen;
  for (const TagFrame& frame : recorded.frames) {
    for (const TagDetection& detection : frame.detections) ++seen[detection.tag];
  }
  if (seen.empty()) return overrides;
  const auto most = std::ranges::max_element(seen, {}, [](const auto& entry) { return entry.second; });
  overrides.anchor = to_string(most->first);
  return overrides;
}

/// Another size than the recording's is another calibration, so it is said.
void tell_of_size(const RecordedLap& recorded, const SetupOverrides& given, const JobControl& control) {
  const Result<TeachSetup> setup = setup_of(recorded, {.anchor = given.anchor});
  if (!given.tag_size_m || !setup || *setup->sizes.default_size_m == *given.tag_size_m) return;
  control.note(fmt::format("note: tags of {} m, as --tag-size-m says; the recording says {} m",
                           *given.tag_size_m, *setup->sizes.default_size_m));
}

/// A map that is known: its tags stand there as surely as it says, and the lap's anchor becomes one of them.
Status take_map(const LocalizeJob& job, RecordedLap& recorded, SetupOverrides& overrides,
                std::optional<LapPrior>& prior) {
  if (job.map.empty()) return {};
  Result<MapFile> map = read_map(map_file_of(job.map));
  if (!map) return tl::unexpected(map.error());
  MapJob extension;
  extension.extend = std::move(*map);
  extension.map_sigma_m = job.map_sigma_m;
  MapLapOptions options;
  Status status = prepare_extension(extension, recorded, overrides, options);
  if (status) prior = std::move(options.prior);
  return status;
}

Result<LapInput> lap_input(const LocalizeJob& job, double from_s, double to_s, const JobControl& control) {
  Result<RecordedLap> recorded = read_lap_files(job.logs, control, nullptr, job.frames);
  if (!recorded) return tl::unexpected(recorded.error());
  if (Status status = believe_files(job, recorded->setup, control); !status)
    return tl::unexpected(status.error());
  if (recorded->frames.empty())
    return fail(ErrorCode::NotFound, "there are no corners of tags in it", {.source = job.logs.front()},
                "Map its tags first, and give the map with --map.");
  const SensorTime first = recorded->frames.front().stamp;
  std::erase_if(recorded->frames, [&](const TagFrame& frame) {
    const double at_s = to_seconds(frame.stamp - first);
    return at_s < from_s || at_s > to_s;
  });
  if (recorded->frames.empty())
    return fail(ErrorCode::InvalidArgument, "no frame with tags lies between --from and --to",
                {.source = job.logs.front()}, "`waymark info` shows how long it is.");
  for (const Error& problem : recorded->setup.problems) control.note("warning: " + to_string(problem));
  SetupOverrides overrides = overrides_of(job, *recorded);
  tell_of_size(*recorded, overrides, control);
  std::optional<LapPrior> prior;
  if (Status status = take_map(job, *recorded, overrides, prior); !status)
    return tl::unexpected(status.error());
  Result<TeachSetup> setup = setup_of(*recorded, overrides);
  if (!setup) return tl::unexpected(setup.error());
  return LapInput{.frames = std::move(recorded->frames),
                  .odometry = std::move(recorded->odometry),
                  .camera = setup->camera,
                  .base_T_cam = setup->base_T_cam,
                  .sizes = setup->sizes,
                  .anchor = setup->anchor,
                  .map_T_anchor = setup->map_T_anchor,
                  .prior = std::move(prior),
                  .more_cameras = setup->more_cameras};
}

}  // namespace

bool can_calibrate_by_lap(const LocalizeJob& job, const JobControl& control) {
  JobControl quiet;
  quiet.cancelled = control.cancelled;
  if (job.map.empty()) return true;
  if (job.logs.empty() || !read_map(map_file_of(job.map))) return false;
  const Result<RecordedLap> recorded = read_lap_files(job.logs, quiet, nullptr, job.frames);
  return recorded && !recorded->frames.empty() && !recorded->odometry.empty();
}

Result<LapCalibration> calibrate_recorded_lap(const LocalizeJob& job, double from_s, double to_s,
                                              const JobControl& control) {
  const Result<LapInput> lap = lap_input(job, from_s, to_s, control);
  if (!lap) return tl::unexpected(lap.error());
  const MapProgress progress = [&](const std::string& stage, int iteration, double cost) {
    control.progress({fmt::format("{}: step {}, cost {:.0f}", stage, iteration, cost)});
    return !control.cancelled();
  };
  Result<LapCalibration> found = calibrate_by_lap(*lap, {}, progress);
  if (found) {
    for (const std::string& words : check_map(*lap, found->map)) control.note("warning: " + words);
  }
  return found;
}

}  // namespace waymark
