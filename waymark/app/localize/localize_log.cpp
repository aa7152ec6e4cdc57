#include "waymark/app/localize/localize_log.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/common/sensor_finding_fields.hpp"
#include "waymark/app/localize/localize_output.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/exchange/landmarks_file.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/yaml/calibration_file.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/localization/innovation_fits.hpp"
#include "waymark/localization/sample_diagnosis.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {

// Reading inputs.
namespace {

namespace fs = std::filesystem;

bool is_observation(const Sample& sample) {
  return std::holds_alternative<TagFrame>(sample) || std::holds_alternative<TagPoseFrame>(sample) ||
         std::holds_alternative<RangeBearing>(sample);
}

bool is_wanted(const Sample& sample) {
  return is_observation(sample) || std::holds_alternative<Odometry>(sample) ||
         std::holds_alternative<ImuSample>(sample) || std::holds_alternative<TruthPose>(sample);
}

/// Detects tags in the recorded images if the recording contains no observations.
Status detect_tags(const std::string& path, const CameraChoice& frames, LocalizeInputs& inputs,
                   const JobControl& control) {
  Result<RecordedLap> lap = read_lap_files({path}, control, nullptr, frames);
  if (!lap) return tl::unexpected(lap.error());
  for (TagFrame& frame : lap->frames) inputs.samples.emplace_back(std::move(frame));
  return {};
}

std::vector<TagFrame> tag_frames_of(const std::vector<Sample>& samples) {
  std::vector<TagFrame> frames;
  for (const Sample& sample : samples)
    if (const auto* frame = std::get_if<TagFrame>(&sample)) frames.push_back(*frame);
  return frames;
}

/// `transforms`: whether odometry may be read from transforms.
Status read_log(const std::string& path, const CameraChoice& frames, bool transforms, LocalizeInputs& inputs,
                const JobControl& control) {
  const auto log = open_recording(path, control);
  if (!log) return tl::unexpected(log.error());
  Result<RecordingSetup> setup = (*log)->setup(frames);
  if (setup && setup->chosen.ambiguous) {
    Error error = *setup->chosen.ambiguous;
    error.place.source = path;
    return tl::unexpected(std::move(error));
  }
  bool has_observations = false;
  bool has_images = false;
  LogSelection used = setup ? (*log)->topics_used(*setup) : LogSelection{};
  used.odometry_in_transforms = transforms;
  const Status status = (*log)->visit_samples(used, [&](Sample sample) -> Status {
    if (control.cancelled()) return fail(ErrorCode::Unreadable, "stopped", {.source = path});
    has_observations = has_observations || is_observation(sample);
    has_images = has_images || std::holds_alternative<CameraFrame>(sample);
    if (setup) turn_into_base(sample, setup->chosen);
    if (is_wanted(sample)) inputs.samples.push_back(std::move(sample));
    return {};
  });
  if (!status) return status;
  for (const LogProblem& problem : (*log)->problems()) {
    if (problem.kind != LogProblem::Kind::Damage) continue;
    inputs.warnings.push_back(to_string(problem.error));
    if (inputs.first_damage.empty()) inputs.first_damage = inputs.warnings.back();
  }
  if (!has_observations && has_images) {
    if (Status detected = detect_tags(path, frames, inputs, control); !detected) return detected;
  }
  if (!setup) return {};
  if (setup->chosen.rectified) take_better_fitting_camera(*setup, tag_frames_of(inputs.samples));
  for (const std::string& note : setup->chosen.notes) control.note("note: " + note);
  if (setup->camera || setup->base_T_cam || !setup->facts.frames.empty() || setup->chosen.camera_error)
    inputs.recorded = *setup;
  if (setup->camera) inputs.setup.sensor.camera = setup->camera;
  if (setup->base_T_cam) inputs.setup.sensor.base_T_sensor = *setup->base_T_cam;
  if (!setup->more_cameras.empty()) inputs.setup.sensor.more_cameras = setup->more_cameras;
  return {};
}

/// Removes samples that do not overlap the observations in time.
void remove_other_clocks(LocalizeInputs& inputs) {
  ClockCheck clocks;
  for (const Sample& sample : inputs.samples) clocks.add(sample);
  inputs.other_clock = clocks.mismatch();
  if (!inputs.other_clock) return;
  inputs.warnings.push_back(to_string(inputs.other_clock->error));
  std::erase_if(inputs.samples, [&](const Sample& sample) {
    const auto kind = stamped_kind(sample);
    return kind && !clocks.overlaps(*kind);
  });
}

/// Whether one of these recordings contains odometry other than in transforms.
bool any_odometry_messages(const std::vector<std::string>& logs, const JobControl& control) {
  return std::ranges::any_of(logs, [&](const std::string& path) {
    const auto log = open_recording(path, silent(control));
    return log && has_odometry_messages(**log);
  });
}

/// Reads the recordings of a single drive. At most one of them may contain odometry.
Status read_logs(const LocalizeJob& job, LocalizeInputs& inputs, const JobControl& control) {
  std::string with_odometry;
  const bool transforms = job.logs.size() == 1 || !any_odometry_messages(job.logs, control);
  for (const std::string& log : job.logs) {
    const auto before = static_cast<std::ptrdiff_t>(inputs.samples.size());
    if (Status status = read_log(log, job.frames, transforms, inputs, control); !status) return status;
    const bool moves = std::any_of(inputs.samples.begin() + before, inputs.samples.end(),
                                   [](const Sample& s) { return std::holds_alternative<Odometry>(s); });
    if (!moves) continue;
    if (!with_odometry.empty())
      return fail(ErrorCode::InvalidArgument,
                  "two recordings contain odometry: this one and " + with_odometry, {.source = log},
                  "All recordings must be of the same drive; localise each drive separately.");
    with_odometry = log;
  }
  return {};
}

Status read_robot_of(const LocalizeJob& job, LocalizeInputs& inputs) {
  std::string robot = job.robot;
  std::error_code ignored;
  const fs::path beside =
      (fs::is_directory(job.map, ignored) ? fs::path(job.map) : fs::path(job.map).parent_path()) /
      "robot.yaml";
  if (robot.empty() && !inputs.setup.sensor.camera && fs::exists(beside, ignored)) robot = beside.string();
  if (robot.empty()) return {};
  const auto path = find_shared("robots", robot, "robot");
  if (!path) return tl::unexpected(path.error());
  const auto description = or_wrong_kind(read_robot(*path), *path, FileUse::Robot);
  if (!description) return tl::unexpected(description.error());
  for (std::string& warning : disagreements(*description, inputs.recorded))
    inputs.warnings.push_back(std::move(warning));
  inputs.setup.sensor = {description->camera, description->model.base_T_cam, description->more_cameras};
  const auto motion = read_robot_motion(*path);
  if (!motion) return tl::unexpected(motion.error());
  if (*motion) inputs.setup.filter.motion = **motion;
  return {};
}

}  // namespace

void take_calibrated(const Calibration& calibration, RiekfOptions& filter) {
  const auto take = [&](const char* name, double& value) {
    if (const auto known = calibration.observable_value(name)) value = *known;
  };
  take("odometry_scale", filter.odometry_scale);
  take("yaw_scale", filter.yaw_scale);
  take("gyro_gain", filter.gyro_gain);
  take("gyro_bias_rad_s", filter.gyro_bias_rad_s);
  take("camera_latency_s", filter.camera_latency_s);
  take("readout_s", filter.camera_readout_s);
  take("corner_sigma_px", filter.corner_sigma_px);
  take("sight_scale", filter.sight_scale);
}

namespace {

Status read_calibration_of(const LocalizeJob& job, LocalizeInputs& inputs) {
  if (job.calibration.empty()) return {};
  const auto calibration =
      or_wrong_kind(read_calibration(job.calibration), job.calibration, FileUse::Calibration);
  if (!calibration) return tl::unexpected(calibration.error());
  if (calibration->camera) {
    inputs.setup.sensor.camera = calibration->camera;
    inputs.recorded.chosen.camera_error.reset();
  }
  SE3& base_T_sensor = inputs.setup.sensor.base_T_sensor;
  if (inputs.planar_sensor) {
    const auto known = [&](const char* name, double given) {
      return calibration->observable_value(name).value_or(given);
    };
    const SE2 given = project_to_plane(base_T_sensor);
    base_T_sensor = lift(SE2(known("mounting_x_m", given.x()), known("mounting_y_m", given.y()),
                             known("mounting_yaw_rad", given.yaw())));
  } else {
    base_T_sensor = calibrated_mounting(base_T_sensor, *calibration);
  }
  take_calibrated(*calibration, inputs.setup.filter);
  return {};
}

/// Applies the options set by the caller. It must run last, because they override the robot file and the
/// calibration.
Status apply_requested(const LocalizeJob& job, LocalizeInputs& inputs) {
  return job.asked ? job.asked(inputs.setup.filter) : Status();
}

/// Rejects invalid input before the localizer runs.
Status check_inputs(const LocalizeJob& job, LocalizeInputs& inputs) {
  const auto count = [&](auto is) { return std::ranges::count_if(inputs.samples, is); };
  const auto lacks = [&](const std::string& what) {
    const std::string damage =
        inputs.first_damage.empty() ? "" : "; first problem found: " + inputs.first_damage;
    return fail(ErrorCode::NotFound, fmt::format("the recording contains {}{}", what, damage),
                {.source = job.logs.front()}, "`waymark info` lists its contents.");
  };
  if (inputs.samples.empty()) return lacks("neither tags nor motion");
  inputs.observations = static_cast<std::size_t>(count(is_observation));
  if (inputs.observations == 0) return lacks("neither tags nor landmark observations");
  const bool corners = count([](const Sample& s) { return std::holds_alternative<TagFrame>(s); }) > 0;
  if (corners && job.robot.empty() && inputs.recorded.chosen.camera_error) {
    // The robot file in the map folder may describe another camera or another image size.
    Error error = *inputs.recorded.chosen.camera_error;
    error.place.source = job.logs.front();
    return tl::unexpected(std::move(error));
  }
  if (corners && !inputs.setup.sensor.camera)
    return fail(ErrorCode::NotFound, "no camera calibration in the recording or in the map folder",
                {.source = job.logs.front()}, "Set `robot` to a robot file with a camera.");
  if (corners && job.robot.empty() && !inputs.recorded.base_T_cam && inputs.recorded.chosen.mounting_error) {
    Error error = *inputs.recorded.chosen.mounting_error;
    error.message = "the recording does not specify the camera mounting: " + error.message;
    error.place.source = job.logs.front();
    return tl::unexpected(std::move(error));
  }
  if (corners && inputs.setup.tags.tags.empty())
    return fail(ErrorCode::InvalidArgument,
                "corners need a map with tag poses, but this one contains only points", {.source = job.map});
  return {};
}

/// Reads the inputs that depend on neither the recording nor the robot: the options and the map.
Result<LocalizeInputs> read_map_of(const LocalizeJob& job) {
  LocalizeInputs inputs;
  if (!std::ranges::all_of(job.start, [](double x) { return std::isfinite(x); }))
    return fail(ErrorCode::InvalidArgument, "the pose contains a non-finite number", {.key = "start"},
                "Give x y in metres and yaw in degrees.");
  if (!std::ranges::all_of(job.sensor_pose, [](double x) { return std::isfinite(x); }))
    return fail(ErrorCode::InvalidArgument, "the pose contains a non-finite number", {.key = "sensor_pose"},
                "Give x y in metres and yaw in degrees.");
  inputs.setup.filter = job.filter;
  inputs.setup.anchor = job.anchor;
  inputs.setup.method = job.method;
  Result<LandmarksFile> map = or_wrong_kind(read_landmarks(job.map, job.tag_size_m), job.map, FileUse::Map);
  if (!map) return tl::unexpected(map.error());
  inputs.setup.landmarks = std::move(map->landmarks);
  inputs.setup.tags = std::move(map->tags);
  inputs.warnings = std::move(map->notes);
  const bool sizes_known = std::ranges::none_of(
      inputs.setup.tags.tags, [&](const auto& tag) { return tag.second.size_m == job.tag_size_m; });
  if (job.tag_size_m && (sizes_known || map->format == "waymark"))
    inputs.warnings.emplace_back("`tag_size_m` is ignored: the map contains tag sizes, or only points");
  return inputs;
}

/// Finds faults of sensors, and corrects the samples and the setup where that is safe.
void correct_sensors(const LocalizeJob& job, LocalizeInputs& inputs) {
  if (job.method == LocalizationKind::Anchor) return;
  LocalizerSetup& setup = inputs.setup;
  inputs.sensors =
      diagnose_sensors(motion_sources(inputs.samples, setup.landmarks, setup.sensor, setup.filter));
  if (job.no_adapt) inputs.sensors = without_scales_and_times(std::move(inputs.sensors));
  apply(inputs.sensors.correction, inputs.samples, setup.filter);
}

/// Applies the mounting of a planar sensor and then the calibration, which overrides it.
Status apply_mounting(const LocalizeJob& job, LocalizeInputs& inputs) {
  if (job.sensor_pose.size() == 3) {
    inputs.planar_sensor = true;
    inputs.setup.sensor.base_T_sensor =
        lift(SE2(job.sensor_pose[0], job.sensor_pose[1], to_radians(job.sensor_pose[2])));
  }
  return read_calibration_of(job, inputs);
}

}  // namespace

Result<LocalizeInputs> read_localize_inputs(const LocalizeJob& job, const RobotDescription& robot,
                                            const std::string& robot_yaml) {
  Result<LocalizeInputs> inputs = read_map_of(job);
  if (!inputs) return inputs;
  inputs->setup.sensor = {robot.camera, robot.model.base_T_cam, robot.more_cameras};
  const auto motion = parse_robot_motion(robot_yaml, robot.model.name + ".yaml");
  if (!motion) return tl::unexpected(motion.error());
  if (*motion) inputs->setup.filter.motion = **motion;
  Status status = apply_mounting(job, *inputs);
  if (status) status = apply_requested(job, *inputs);
  if (!status) return tl::unexpected(status.error());
  if (inputs->setup.tags.tags.empty())
    return fail(ErrorCode::InvalidArgument,
                "a camera needs a map with tag poses, but this one contains only points", {.source = job.map},
                "Use a map written by `waymark map`.");
  return inputs;
}

Status check_job(const LocalizeJob& job) {
  if (job.logs.empty())
    return fail(ErrorCode::InvalidArgument, "nothing to localise", {},
                "Give a recording, or set `robot` to a running robot, for example `robot=ros2:limo`.");
  if (job.no_adapt && job.method == LocalizationKind::Anchor)
    return fail(ErrorCode::InvalidArgument, "method anchor has no filter", {.key = "no_adapt"},
                "Omit `no_adapt`, or choose another `method`.");
  return {};
}

Result<LocalizeInputs> read_localize_inputs(const LocalizeJob& job, const JobControl& control) {
  if (Status sound = check_job(job); !sound) return tl::unexpected(sound.error());
  Result<LocalizeInputs> read = read_map_of(job);
  if (!read) return read;
  LocalizeInputs& inputs = *read;
  Status status = read_logs(job, inputs, control);
  if (!status) return tl::unexpected(status.error());
  remove_other_clocks(inputs);
  status = read_robot_of(job, inputs);
  if (status) status = apply_mounting(job, inputs);
  if (status) status = apply_requested(job, inputs);
  if (status) status = check_inputs(job, inputs);
  if (!status) return tl::unexpected(status.error());
  const bool poses = std::ranges::any_of(
      inputs.samples, [](const Sample& s) { return std::holds_alternative<TagPoseFrame>(s); });
  if (poses && !inputs.planar_sensor && !inputs.setup.sensor.camera && job.robot.empty()) {
    // The only plausible assumption is a camera that looks forward from a point above the base origin.
    inputs.setup.sensor.base_T_sensor =
        SE3(body_R_optical(), inputs.setup.sensor.base_T_sensor.translation());
    inputs.mounting_guessed = true;
    inputs.warnings.emplace_back(
        "camera mounting unknown; assumed above the origin of base_link, facing forward (set `robot`)");
  }
  const bool ranges = std::ranges::any_of(
      inputs.samples, [](const Sample& s) { return std::holds_alternative<RangeBearing>(s); });
  if (ranges && job.sensor_pose.empty() && job.robot.empty() && job.calibration.empty()) {
    inputs.mounting_guessed = true;
    inputs.warnings.emplace_back(
        "mounting of the range sensor unknown; assumed at the origin of base_link "
        "(set `sensor_pose`)");
  }
  std::ranges::stable_sort(inputs.samples, {}, stamp_of);
  correct_sensors(job, inputs);
  return read;
}

// Running the localizer.
namespace {

Status run(Localizer& localizer, const LocalizeInputs& inputs, bool hindsight, const JobControl& control,
           LocalizeOutput& output) {
  for (const Sample& sample : inputs.samples) {
    if (control.cancelled()) return fail(ErrorCode::Unwritable, "stopped: nothing was written");
    localizer.add(sample);
    Status status = output.on_sample(sample);
    for (const NisRecord& record : localizer.method().comparisons())
      if (status) status = output.on_comparison(record);
    localizer.method().clear_comparisons();
    const auto estimate = localizer.estimate();
    if (status && estimate && !hindsight) status = output.on_estimate(*estimate);
    if (!status) return status;
  }
  for (const LocalizationEstimate& estimate : localizer.smoothed()) {
    if (Status status = output.on_estimate(estimate); !status) return status;
  }
  return {};
}

/// Results of a first run over the recording, which are used to correct the filter parameters.
struct FirstRun {
  std::optional<SystematicVerdict> suspect{};
  double latency_off_s = 0;                 ///< correction to the latency, estimated from innovations
  bool corners = false;                     ///< whether the recording contains tag corners
  bool noise_inconsistent = false;          ///< according to the NIS of single observations
  bool lasting_noise_inconsistent = false;  ///< according to the NIS of averaged observations
};

/// NIS summed over all observations, with outliers capped. Tags that contradict the map are excluded, unless
/// there are many such tags.
class NisSums {
 public:
  explicit NisSums(const Landmarks& landmarks)
      : landmarks_(landmarks), all_(static_cast<std::size_t>(landmarks.size())) {}

  void add(const NisRecord& record) {
    constexpr double kCapPerRow = 16;
    const int landmark =
        landmarks_.find(record.tag) >= 0 ? landmarks_.find(record.tag) : landmarks_.find(record.tag.number);
    if (landmark < 0) return;
    Sums& sums = all_[static_cast<std::size_t>(landmark)];
    sums.nis += std::min(record.nis, kCapPerRow * record.rows);
    sums.rows += record.rows;
  }
  [[nodiscard]] std::optional<double> per_row(const TagWatch& watch) const {
    // If the fraction of usable rows is smaller, the tags are not the cause.
    constexpr double kMinUsableShare = 0.5;
    Sums total;
    Sums usable;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      total.nis += all_[i].nis;
      total.rows += all_[i].rows;
      if (!watch.usable(static_cast<int>(i))) continue;
      usable.nis += all_[i].nis;
      usable.rows += all_[i].rows;
    }
    const Sums& counted = usable.rows > kMinUsableShare * total.rows ? usable : total;
    return counted.rows > 0 ? std::optional(counted.nis / counted.rows) : std::nullopt;
  }

 private:
  struct Sums {
    double nis = 0;
    double rows = 0;
  };
  const Landmarks& landmarks_;
  std::vector<Sums> all_;
};

FirstRun first_run(const LocalizerSetup& setup, const std::vector<Sample>& samples,
                   const JobControl& control) {
  LocalizerSetup plain = setup;
  if (setup.method != LocalizationKind::Ekf) plain.method = LocalizationKind::Riekf;
  Result<Localizer> localizer = Localizer::make(plain);
  if (!localizer) return {};
  NisSums nis(setup.landmarks);
  for (const Sample& sample : samples) {
    if (control.cancelled()) return {};
    localizer->add(sample);
    for (const NisRecord& record : localizer->method().comparisons()) nis.add(record);
    localizer->method().clear_comparisons();
  }
  const Tracker& tracker = localizer->filter()->tracker();
  const auto per_row = nis.per_row(tracker.watch());
  FirstRun found{.suspect = tracker.suspect(),
                 .noise_inconsistent = per_row && noise_is_inconsistent(*per_row, {}),
                 .lasting_noise_inconsistent = noise_is_inconsistent(0, tracker.lasting_nis())};
  const auto fit = tracker.systematic().fit(SystematicVector::Constant(0.1));  // with a weak prior
  constexpr Eigen::Index kLatency = 7;
  if (fit) found.latency_off_s = fit->value[kLatency];
  found.corners = tracker.sees_corners();
  return found;
}

/// Estimates the latency from innovations with Gauss-Newton steps, each of which requires a run over the
/// recording. Returns `nullopt` if they do not converge.
std::optional<double> find_latency(LocalizerSetup setup, const std::vector<Sample>& samples, FirstRun& first,
                                   const JobControl& control) {
  constexpr int kMaxRuns = 6;
  constexpr double kConverged_s = 0.001;
  constexpr double kMaxChange_s = 0.3;
  const double given_s = setup.filter.camera_latency_s;
  FirstRun last = first;
  for (int i = 0; i < kMaxRuns && std::abs(last.latency_off_s) > kConverged_s; ++i) {
    setup.filter.camera_latency_s += last.latency_off_s;
    if (std::abs(setup.filter.camera_latency_s - given_s) > kMaxChange_s) return std::nullopt;
    last = first_run(setup, samples, control);
  }
  if (last.suspect && last.suspect->suspect == Suspect::CameraLatency) return std::nullopt;
  first = last;
  return setup.filter.camera_latency_s;
}

/// Only true for cameras, because with coarse ranges latency cannot be distinguished from yaw noise.
bool is_camera_latency(const FirstRun& first) {
  return first.suspect && first.suspect->suspect == Suspect::CameraLatency && first.corners;
}

std::string latency_message(double found_s, double given_s) {
  return fmt::format(
      "camera latency: {:.3f} s estimated from innovations, {:.3f} s given; using {:.3f} s. Set it with "
      "`camera_latency_s`, or run `waymark calibrate robot` and set `calibration` to the resulting file. "
      "`no_adapt` keeps the given value",
      found_s, given_s, found_s);
}

std::string noise_message(const NoiseFit& fit) {
  return fmt::format(
      "noise estimated from the recording, relative to the assumed noise: distances {:.2g}, headings {:.2g}, "
      "observations {:.2g}. Standard deviation of tag positions: {:.3g} m (`no_adapt` keeps the assumed "
      "noise)",
      fit.motion_ratio, fit.turn_ratio, fit.sensor_ratio, fit.tag_sigma_m);
}

/// Estimates noise and latency from the recording, and returns one message per change. An inconsistent NIS of
/// single observations is corrected first, because all other tests depend on the noise. If only the NIS of
/// averaged observations is inconsistent, it is considered only if no parameter is suspect, because a wrong
/// parameter also causes lasting errors.
std::vector<std::string> adapt(const std::vector<Sample>& samples, LocalizerSetup& setup, FirstRun& first,
                               const JobControl& control) {
  std::vector<std::string> messages;
  if (first.noise_inconsistent || (first.lasting_noise_inconsistent && !first.suspect)) {
    const NoiseFit noise = adapt_noise(samples, setup.landmarks, setup.sensor, setup.filter,
                                       [&] { return !control.cancelled(); });
    if (noise.adapted) {
      setup.filter = noise.options;
      messages.push_back(noise_message(noise));
      first = first_run(setup, samples, control);
    }
  }
  if (!is_camera_latency(first)) return messages;
  if (const auto found_s = find_latency(setup, samples, first, control)) {
    messages.push_back(latency_message(*found_s, setup.filter.camera_latency_s));
    setup.filter.camera_latency_s = *found_s;
  }
  return messages;
}

/// `camera_latency_s`: with the corrections.
std::string sensor_message(const SensorFinding& finding, double camera_latency_s) {
  const bool latency = finding.found.likely.front().fault == SensorFault::ObservationTime &&
                       finding.measure == SensorMeasure::Corrected;
  if (!latency) return describe(finding);
  return fmt::format("{}. Set the camera latency with `camera_latency_s={:.3f}`", describe(finding),
                     camera_latency_s);
}

}  // namespace

void start_localizer(const LocalizeJob& job, Localizer& localizer) {
  if (job.start.size() != 3) return;
  const SE2 map_T_base(job.start[0], job.start[1], to_radians(job.start[2]));
  localizer.method().start_from(map_T_base, 0.05, 0.05);
}

Result<LocalizeReport> localize(const LocalizeJob& job, const LocalizeInputs& inputs,
                                const JobControl& control) {
  const Stopwatch watch;
  if (Status status = check_localize_output(job.output); !status) return tl::unexpected(status.error());
  LocalizerSetup setup = inputs.setup;
  FirstRun first =
      setup.method == LocalizationKind::Anchor ? FirstRun{} : first_run(setup, inputs.samples, control);
  const std::vector<std::string> adapted =
      job.no_adapt ? std::vector<std::string>{} : adapt(inputs.samples, setup, first, control);
  Result<Localizer> localizer = Localizer::make(setup);
  if (!localizer) return tl::unexpected(localizer.error());
  if (first.suspect && localizer->filter() != nullptr) localizer->filter()->tracker().suspect(*first.suspect);
  start_localizer(job, *localizer);
  Result<LocalizeOutput> output = LocalizeOutput::open(
      job.output, setup,
      {.name = std::filesystem::path(job.logs.front()).filename().string(), .map = job.map});
  if (!output) return tl::unexpected(output.error());
  const bool hindsight = job.method == LocalizationKind::Smoother && job.filter.lag_s <= 0;
  const Status status = run(*localizer, inputs, hindsight, control, *output);
  Result<LocalizeReport> report = output->close(!status);
  if (!status) {
    std::error_code ignored;  // otherwise, a part of the drive could be mistaken for all of it
    if (control.cancelled() && std::filesystem::is_regular_file(job.output, ignored))
      std::filesystem::remove(job.output, ignored);
    return tl::unexpected(status.error());
  }
  if (!report) return report;
  report->method = job.method;
  report->sensors = inputs.sensors.findings;
  report->problems = localizer->method().problems();
  for (const SensorFinding& finding : inputs.sensors.findings) {
    if (is_odometry_scale(finding)) continue;
    report->problems.push_back(sensor_message(finding, inputs.setup.filter.camera_latency_s));
  }
  if (first.suspect)
    report->problems.emplace_back(
        "the innovations are larger than predicted; the reported covariance accounts for this");
  for (const std::string& message : adapted) report->problems.push_back(message);
  if (const RiekfLocalizer* filter = localizer->filter())
    report->lasting_nis = filter->tracker().lasting_nis();
  report->wall_s = watch.seconds();
  return report;
}

namespace {

struct LastPose {
  SE2 map_T_base{};
  bool certain = false;
};

ReportFields fields(const LastPose& last) {
  return {{"x_m", "Position along the x axis of the map", last.map_T_base.x()},
          {"y_m", "Position along the y axis of the map", last.map_T_base.y()},
          {"yaw_rad", "Heading", last.map_T_base.yaw()},
          {"certain", "Whether the estimate is certain", last.certain}};
}

}  // namespace

ReportFields fields(const LocalizeReport& report) {
  const auto last = part(report.last, [](const LocalizationEstimate& estimate) {
    return LastPose{estimate.map_T_base, estimate.certain};
  });
  return {
      {"method", "Localisation method", to_string(report.method)},
      {"estimates", "Number of estimates, certain or not", report.estimates},
      {"certain", "Number of certain estimates", report.certain},
      {"first_fix_s", "Time from the first sample to the first certain estimate", report.first_fix_s},
      {"observations", "Number of map tag observations that were compared with an estimate", report.compared},
      {"accepted", "Number of accepted observations", report.accepted},
      {"nis_mean",
       "Mean NIS of accepted observations per degree of freedom; 1 if the assumed noise is correct",
       report.nis_mean},
      {"lasting_nis",
       "Mean NIS of averages of 30 residuals of one tag; 1 if lasting errors are modelled correctly",
       report.lasting_nis},
      {"duration_s", "Duration of the drive", report.duration_s},
      {"wall_s", "Duration of the run", report.wall_s},
      {"last", "The last estimate", last},
      {"sensors", kSensorsHelp, report.sensors},
      {"problems", "Swapped or moved tags, tags with a wrong size, and other problems; one sentence each",
       report.problems}};
}

std::string to_text(const LocalizeReport& report) {
  if (report.estimates == 0) return fmt::format("no estimate within {:.1f} s\n", report.duration_s);
  std::string text =
      fmt::format("{} estimates in {:.1f} s, {:.1f} % of them certain", report.estimates, report.duration_s,
                  100.0 * static_cast<double>(report.certain) / static_cast<double>(report.estimates));
  text += report.first_fix_s ? fmt::format(", the first after {:.2f} s\n", *report.first_fix_s) : "\n";
  if (report.compared > 0)
    text += fmt::format("{} of {} observations accepted, NIS {:.2f} per degree of freedom\n", report.accepted,
                        report.compared, report.nis_mean);
  if (report.last && report.certain > 0)
    text += fmt::format("last: x {:.3f} m, y {:.3f} m, heading {:.1f} deg, within {:.3f} m (one sigma)\n",
                        report.last->map_T_base.x(), report.last->map_T_base.y(),
                        to_degrees(report.last->map_T_base.yaw()), report.last->position_sigma_m());
  if (report.lasting_nis)
    text += fmt::format(
        "averages of 30 observations of one tag: NIS {:.2f} (1 if lasting errors are modelled correctly)\n",
        *report.lasting_nis);
  return text;
}

std::vector<std::string> localization_warnings(const LocalizeReport& report) {
  std::vector<std::string> warnings;
  if (report.certain == 0) warnings.emplace_back("no certain estimate");
  if (report.lasting_nis.value_or(0) > 4)
    warnings.emplace_back(
        "errors persist longer than modelled, so the covariance is too small: run `waymark calibrate robot`, "
        "or check `sensor_pose`, `tag_sigma_m` and `mounting_sigma_rad`");
  if (report.compared > 0 && 10 * report.accepted < report.compared)
    warnings.emplace_back(
        "warning: most observations contradict the map. Is this the map of the right place, and the camera "
        "of the right robot (`robot`, `calibration`)?");
  return warnings;
}

}  // namespace waymark
