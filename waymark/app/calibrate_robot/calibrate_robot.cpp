#include "waymark/app/calibrate_robot/calibrate_robot.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/common/sensor_finding_fields.hpp"
#include "waymark/app/map/map_extension.hpp"
#include "waymark/config/yaml/calibration_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/mapping/lap/map_checks.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {

// Calibrating from a lap.
namespace {

namespace fs = std::filesystem;

/// Applies the robot file and the given calibration. Both take precedence over the recording.
Status apply_files(const LocalizeJob& job, RecordingSetup& setup, const JobControl& control) {
  std::vector<std::string> warnings;
  if (Status status = take_robot(job.robot, setup, warnings); !status) return status;
  for (const std::string& warning : warnings) control.note("warning: " + warning);
  if (job.calibration.empty()) return {};
  const auto calibration =
      or_wrong_kind(read_calibration(job.calibration), job.calibration, FileUse::Calibration);
  if (!calibration) return tl::unexpected(calibration.error());
  if (calibration->camera) setup.camera = calibration->camera;
  if (setup.base_T_cam) setup.base_T_cam = calibrated_mounting(*setup.base_T_cam, *calibration);
  return {};
}

/// The tag size and the anchor. If the recording contains no anchor, the tag observed most often is used,
/// because the map frame does not matter here.
SetupOverrides overrides_of(const LocalizeJob& job, const RecordedLap& recorded) {
  SetupOverrides overrides{.tag_size_m = job.tag_size_m};
  if (setup_of(recorded, overrides)) return overrides;
  std::map<TagId, int> counts;
  for (const TagFrame& frame : recorded.frames) {
    for (const TagDetection& detection : frame.detections)
      if (usable_corners(detection)) ++counts[detection.tag];
  }
  if (counts.empty()) return overrides;
  const auto most_observed =
      std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; });
  overrides.anchor = to_string(most_observed->first);
  return overrides;
}

/// Reports if the given tag size differs from the one in the recording, because it affects the calibration.
void report_size_conflict(const RecordedLap& recorded, const SetupOverrides& given,
                          const JobControl& control) {
  const Result<TeachSetup> setup = setup_of(recorded, {.anchor = given.anchor});
  if (!given.tag_size_m || !setup || *setup->sizes.default_size_m == *given.tag_size_m) return;
  control.note(fmt::format("note: using a tag size of {} m (`tag_size_m`) instead of {} m (recording)",
                           *given.tag_size_m, *setup->sizes.default_size_m));
}

/// Adds the map, if the job has one. Its tags are constrained by their covariances, and one of them becomes
/// the anchor.
Status take_map(const LocalizeJob& job, RecordedLap& recorded, SetupOverrides& overrides,
                std::optional<LapPrior>& prior) {
  if (job.map.empty()) return {};
  Result<MapFile> map = or_wrong_kind(read_map(map_file_of(job.map)), job.map, FileUse::OwnMap);
  if (!map) return tl::unexpected(map.error());
  MapJob extension;
  extension.extend = std::move(*map);
  extension.map_sigma_m = job.map_sigma_m;
  MapLapOptions options;
  Status status = prepare_extension(extension, recorded, overrides, options);
  if (status) prior = std::move(options.prior);
  return status;
}

tl::unexpected<Error> in_recording(Error error, const LocalizeJob& job) {
  error.place.source = job.logs.front();
  return tl::unexpected(std::move(error));
}

Result<LapInput> lap_input(const LocalizeJob& job, double from_s, double to_s, const JobControl& control) {
  Result<RecordedLap> recorded = read_lap_files(job.logs, control, nullptr, job.frames);
  if (!recorded) return tl::unexpected(recorded.error());
  if (Status status = apply_files(job, recorded->setup, control); !status)
    return tl::unexpected(status.error());
  if (recorded->frames.empty()) {
    std::string message = "the recording contains no tag corners";
    if (!recorded->setup.problems.empty())
      message += fmt::format("; first problem found: {}", to_string(recorded->setup.problems.front()));
    return fail(ErrorCode::NotFound, std::move(message), {.source = job.logs.front()},
                "Make a map of the tags, and set `map` to it.");
  }
  if (affects(recorded->other_clock, StampedKind::Odometry))
    return in_recording(recorded->other_clock->error, job);
  const SensorTime first = recorded->frames.front().stamp;
  std::erase_if(recorded->frames, [&](const TagFrame& frame) {
    const double at_s = to_seconds(frame.stamp - first);
    return at_s < from_s || at_s > to_s;
  });
  if (recorded->frames.empty())
    return fail(ErrorCode::InvalidArgument, "the recording contains no tags between `from` and `to`",
                {.source = job.logs.front()}, "`waymark info` shows the duration of the recording.");
  for (const Error& problem : recorded->setup.problems) control.note("warning: " + to_string(problem));
  SetupOverrides overrides = overrides_of(job, *recorded);
  report_size_conflict(*recorded, overrides, control);
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
  return recorded && !recorded->frames.empty() &&
         (!recorded->odometry.empty() || affects(recorded->other_clock, StampedKind::Odometry));
}

Result<LapCalibration> calibrate_recorded_lap(const LocalizeJob& job, double from_s, double to_s,
                                              const JobControl& control) {
  Result<LapInput> lap = lap_input(job, from_s, to_s, control);
  if (!lap) return tl::unexpected(lap.error());
  const MapProgress progress = [&](const std::string& stage, int iteration, double cost) {
    control.progress({fmt::format("{}: step {}, cost {:.0f}", stage, iteration, cost)});
    return !control.cancelled();
  };
  Result<LapCalibration> found = calibrate_by_lap(*lap, {}, progress);
  if (found) {
    lap->sizes = found_sizes(lap->sizes, found->map);
    for (const std::string& warning : check_map(*lap, found->map)) control.note("warning: " + warning);
  }
  return found;
}

// Calibrating from innovations, choosing the method, and reporting.
namespace {

/// For each value, advice on how to drive to make it observable, in the order of Calibrated.
constexpr std::array<const char*, kCalibrated> kDriveAdvice = {
    "Turn on the spot in both directions with tags in view.",
    "Turn on the spot in both directions with tags in view.",
    "Drive several metres straight ahead with tags in view.",
    "Drive several metres straight past several tags.",
    "Turn on the spot in both directions, several full turns each.",
    "Record the gyro, and turn on the spot in both directions, several full turns each.",
    "Drive at two speeds and turn quickly. At constant speed, image latency cannot be distinguished from a "
    "camera that is mounted further back.",
    "Observe the same tags from near and far.",
    "Observe the same tags from near and far.",
    "Drive past tags on both sides.",
    "Observe the same tags from near and far.",
    "Observe the same tags from near and far."};

/// The samples in an interval. Times are relative to the first sample.
std::vector<Sample> within(const std::vector<Sample>& samples, double from_s, double to_s) {
  std::vector<Sample> kept;
  for (const Sample& sample : samples) {
    const double at_s = to_seconds(stamp_of(sample) - stamp_of(samples.front()));
    if (at_s >= from_s && at_s <= to_s) kept.push_back(sample);
  }
  return kept;
}

Calibration calibration_of(const LocalizeInputs& inputs, const InnovationFit& fit) {
  Calibration calibration;
  const MountedSensor sensor = calibrated_sensor(inputs.setup.sensor, fit.value);
  calibration.camera = sensor.camera;
  const SE3& base_T_sensor = sensor.base_T_sensor;
  CalibratedNumbers value = fit.value;
  value[static_cast<std::size_t>(Calibrated::MountingX)] = base_T_sensor.translation().x();
  value[static_cast<std::size_t>(Calibrated::MountingY)] = base_T_sensor.translation().y();
  value[static_cast<std::size_t>(Calibrated::MountingYaw)] =
      inputs.planar_sensor ? project_to_plane(base_T_sensor).yaw() : camera_mounting(base_T_sensor).yaw_rad;
  value[static_cast<std::size_t>(Calibrated::MountingZ)] = base_T_sensor.translation().z();
  value[static_cast<std::size_t>(Calibrated::MountingRoll)] = camera_mounting(base_T_sensor).roll_rad;
  value[static_cast<std::size_t>(Calibrated::MountingPitch)] = camera_mounting(base_T_sensor).pitch_rad;
  for (std::size_t i = 0; i < kCalibrated; ++i) {
    const std::string name(to_string(static_cast<Calibrated>(i)));
    if (fit.sigma[i] == 0) continue;  // this value was not estimated
    CalibratedValue& entry = calibration.values[name];
    entry = {.value = value[i], .sigma = fit.sigma[i]};
    if (fit.known[i]) {
      if (fit.kept[i]) entry.advice = "The given value is kept, because it is consistent with the drive.";
      continue;
    }
    entry.verdict = CalibrationVerdict::Unobservable;
    entry.advice = kDriveAdvice[i];
  }
  calibration.provenance = {{"method", "innovations"},
                            {"innovations_before", fmt::format("{:.3f}", fit.cost_before)},
                            {"innovations_after", fmt::format("{:.3f}", fit.cost_after)},
                            {"held_out_before", fmt::format("{:.3f}", fit.held_out_before)},
                            {"held_out_after", fmt::format("{:.3f}", fit.held_out_after)}};
  return calibration;
}

Error drive_error(ErrorCode code, std::string message, const CalibrateRobotJob& job, std::string hint) {
  return {code, std::move(message), {.source = job.drive.logs.front()}, std::move(hint)};
}

Status check_job(const CalibrateRobotJob& job) {
  if (job.drive.map.empty() && job.by == CalibrateRobotBy::Innovations)
    return fail(ErrorCode::InvalidArgument, "method innovations requires a tag map", {.key = "by"},
                "Set `map`.");
  if (!(job.from_s < job.to_s))
    return fail(ErrorCode::InvalidArgument,
                fmt::format("empty interval: `from={:g}` is not before `to={:g}`", job.from_s, job.to_s),
                {.key = "to"},
                "Set `to` to a time after `from`; both count from the start of the recording.");
  if (job.drive.output.empty()) return {};
  Status writable = check_output_file(job.drive.output);
  return writable ? check_calibration_place(job.drive.output) : writable;
}

Result<CalibrateRobotReport> by_lap(const CalibrateRobotJob& job, const JobControl& control) {
  Result<LapCalibration> found = calibrate_recorded_lap(job.drive, job.from_s, job.to_s, control);
  if (!found) {
    Error error = found.error();
    if (error.place.source.empty() && error.place.key.empty()) error.place.source = job.drive.logs.front();
    return tl::unexpected(std::move(error));
  }
  CalibrateRobotReport report{.calibration = found->calibration, .lap = std::move(*found)};
  report.calibration.provenance.emplace_back("recording", job.drive.logs.front());
  return report;
}

Result<CalibrateRobotReport> by_innovations(const CalibrateRobotJob& job, const JobControl& control) {
  Result<LocalizeInputs> inputs = read_localize_inputs(job.drive, control);
  if (!inputs) return tl::unexpected(inputs.error());
  for (const SensorFinding& finding : inputs->sensors.findings) {
    if (!is_odometry_scale(finding)) inputs->warnings.push_back(describe(finding));
  }
  // Ground truth is not used here.
  if (affects(inputs->other_clock, StampedKind::Odometry) || affects(inputs->other_clock, StampedKind::Imu))
    return in_recording(inputs->other_clock->error, job.drive);
  const std::vector<Sample> samples = within(inputs->samples, job.from_s, job.to_s);
  if (samples.empty())
    return tl::unexpected(drive_error(ErrorCode::InvalidArgument,
                                      "the recording contains no data between `from` and `to`", job,
                                      "`waymark info` shows the duration of the recording."));
  int runs = 0;
  InnovationFitOptions options;
  if (inputs->mounting_guessed)
    options.keep_sigma = 0;  // the mounting was only assumed, so no given value should be kept
  options.keep_going = [&] {
    control.progress({fmt::format("filter run {} of about 20", ++runs)});
    return !control.cancelled();
  };
  Result<InnovationFit> fit = calibrate_by_innovations(samples, inputs->setup.landmarks, inputs->setup.sensor,
                                                       inputs->setup.filter, options);
  if (!fit) return tl::unexpected(fit.error());
  CalibrateRobotReport report{.calibration = calibration_of(*inputs, *fit),
                              .innovations = *fit,
                              .warnings = std::move(inputs->warnings)};
  report.calibration.provenance.emplace_back("recording", job.drive.logs.front());
  report.calibration.provenance.emplace_back("map", job.drive.map);
  return report;
}

bool has_no_known_value(const Calibration& calibration) {
  return std::ranges::none_of(calibration.values, [](const auto& entry) {
    return entry.second.verdict == CalibrationVerdict::Known;
  });
}

}  // namespace

Result<CalibrateRobotReport> calibrate_robot(const CalibrateRobotJob& job, const JobControl& control) {
  if (Status status = check_job(job); !status) return tl::unexpected(status.error());
  const bool lap = job.by == CalibrateRobotBy::Lap ||
                   (job.by == CalibrateRobotBy::Either && can_calibrate_by_lap(job.drive, control));
  Result<CalibrateRobotReport> report = lap ? by_lap(job, control) : by_innovations(job, control);
  if (control.cancelled()) return fail(ErrorCode::Unwritable, "stopped; nothing was written");
  return report;
}

Result<std::string> write_robot_calibration(const CalibrateRobotJob& job,
                                            const CalibrateRobotReport& report) {
  if (report.innovations && report.innovations->changed && !report.innovations->improved)
    return tl::unexpected(drive_error(
        ErrorCode::NotFound,
        "the estimated values do not fit both the drive and its held-out third better than the given "
        "values; nothing was written",
        job,
        "Record a longer drive at two speeds with turns in both directions. `tag_sigma_m` and "
        "`point_sigma_m` set the assumed accuracy of map and observations."));
  if (has_no_known_value(report.calibration))
    return tl::unexpected(drive_error(ErrorCode::NotFound,
                                      "this drive determines none of the values; nothing was written", job,
                                      "For each value, the table contains advice on how to drive."));
  if (job.drive.output.empty()) return std::string();
  if (Status place = check_calibration_place(job.drive.output); !place) return tl::unexpected(place.error());
  auto earlier = move_aside(job.drive.output, to_yaml(report.calibration));
  if (!earlier) return earlier;
  if (Status status = write_calibration(job.drive.output, report.calibration); !status)
    return tl::unexpected(status.error());
  return earlier;
}

ReportFields fields(const CalibrateRobotReport& report) {
  ReportFields values;
  for (const std::string& name : calibration_names()) {
    const auto found = report.calibration.values.find(name);
    if (found == report.calibration.values.end()) continue;
    const CalibratedValue& v = found->second;
    const bool known = v.verdict == CalibrationVerdict::Known;
    values.push_back({name, "",
                      ReportFields{{"value", "", v.value},
                                   {"sigma", "", v.sigma},
                                   {"verdict", "", known ? "known" : "unobservable"},
                                   {"advice", "", v.advice}}});
  }
  const auto& fit = report.innovations;
  return {
      {"values", "Value, sigma, verdict and advice for each name in calibration.yaml",
       if_any(values.empty() ? std::nullopt : std::optional(values))},
      {"tags", "Method lap: number of mapped tags",
       if_any(part(report.lap, [](const LapCalibration& lap) { return lap.map.map.tags.size(); }))},
      {"corners_rms_px", "Method lap: root mean square reprojection error of the corners",
       if_any(part(report.lap, [](const LapCalibration& lap) { return lap.map.rms_px; }))},
      {"innovations_before", "Method innovations: mean NIS per degree of freedom with the given values",
       if_any(part(fit, &InnovationFit::cost_before))},
      {"innovations_after", "Method innovations: mean NIS per degree of freedom with the estimated values",
       if_any(part(fit, &InnovationFit::cost_after))},
      {"held_out_before", "Like innovations_before, for the held-out third of the drive",
       if_any(part(fit, &InnovationFit::held_out_before))},
      {"held_out_after", "Like innovations_after, for the held-out third of the drive",
       if_any(part(fit, &InnovationFit::held_out_after))},
      {"improved", "Whether the estimated values fit better, on both the fitted and the held-out part",
       if_any(part(fit, &InnovationFit::improved))},
      {"runs", "Number of filter runs", if_any(part(fit, &InnovationFit::runs))}};
}

std::string to_text(const CalibrateRobotReport& report) {
  std::string text;
  for (const std::string& name : calibration_names()) {
    const auto found = report.calibration.values.find(name);
    if (found == report.calibration.values.end()) continue;
    const CalibratedValue& v = found->second;
    text += v.verdict == CalibrationVerdict::Known
                ? fmt::format("{:<25}{:>12.5f} +- {:.5f}{}{}\n", name, v.value, v.sigma,
                              v.advice.empty() ? "" : "    ", v.advice)
                : fmt::format("{:<25}{:>12}    {}\n", name, "unobservable", v.advice);
  }
  if (report.lap)
    text += fmt::format("estimated together with the poses of {} tags; reprojection error {:.2f} px (rms)\n",
                        report.lap->map.map.tags.size(), report.lap->map.rms_px);
  if (const auto& fit = report.innovations)
    text += fmt::format(
        "NIS per degree of freedom: {:.3f} before, {:.3f} after; on the held-out third of the drive: {:.3f} "
        "before, {:.3f} after\n",
        fit->cost_before, fit->cost_after, fit->held_out_before, fit->held_out_after);
  return text;
}

}  // namespace waymark
