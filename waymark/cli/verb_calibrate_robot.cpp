#include <array>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/calibrate_lap.hpp"
#include "waymark/cli/detections_json.hpp"
#include "waymark/cli/file_names.hpp"
#include "waymark/cli/frame_flags.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/localize_run.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/page_files.hpp"
#include "waymark/cli/robot_calibration_report.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/calibration_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/jobs/staged_folder.hpp"
#include "waymark/localization/innovation_calibration.hpp"
#include "waymark/samples/camera_body.hpp"

namespace waymark::cli {
namespace {

struct CalibrateRobotArgs {
  explicit CalibrateRobotArgs(CLI::App& app) : filter(app, "Filter"), motion(app, "Filter: motion") {}

  LocalizeJob job{};
  std::string by;
  double from_s = 0;
  double to_s = std::numeric_limits<double>::infinity();
  bool json = false;
  OptionFlags<RiekfOptions> filter;
  OptionFlags<MotionNoise> motion;
};

/// What to drive so that a number can be told, in the order of Calibrated.
constexpr std::array<const char*, kCalibrated> kAdvice = {
    "Turn on the spot, both ways, with tags in view.",
    "Turn on the spot, both ways, with tags in view.",
    "Drive straight ahead for some metres with tags in view.",
    "Drive some metres straight, past several tags.",
    "Turn both ways on the spot, several times round.",
    "Record the gyro, and turn both ways on the spot, several times round.",
    "Drive at two speeds and turn quickly: at constant speed a late picture and a camera further back look "
    "alike.",
    "Look at the same tags from near and from afar.",
    "Look at the same tags from near and from afar.",
    "Drive past tags on both sides.",
    "Look at the same tags from near and from afar.",
    "Look at the same tags from near and from afar."};

/// The samples between two times after the first.
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
  const MountedSensor sensor = calibrated_sensor(inputs.setup.eye, fit.value);
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
    if (fit.sigma[i] == 0) continue;  // was not sought
    CalibratedValue& entry = calibration.values[name];
    entry = {.value = value[i], .sigma = fit.sigma[i]};
    if (fit.known[i]) {
      if (fit.kept[i]) entry.advice = "As given: the drive agrees.";
      continue;
    }
    entry.verdict = CalibrationVerdict::Unobservable;
    entry.advice = kAdvice[i];
  }
  calibration.provenance = {{"method", "innovations"},
                            {"innovations_before", fmt::format("{:.3f}", fit.cost_before)},
                            {"innovations_after", fmt::format("{:.3f}", fit.cost_after)},
                            {"held_out_before", fmt::format("{:.3f}", fit.held_out_before)},
                            {"held_out_after", fmt::format("{:.3f}", fit.held_out_after)}};
  return calibration;
}

std::string calibration_text(const Calibration& calibration, const InnovationFit& fit) {
  return values_text(calibration) + fmt::format(
                                        "NIS per degree of freedom: {:.3f} before, {:.3f} after; of the "
                                        "third of the drive that was held out: "
                                        "{:.3f} before, {:.3f} after\n",
                                        fit.cost_before, fit.cost_after, fit.held_out_before,
                                        fit.held_out_after);
}

nlohmann::ordered_json calibration_json(const Calibration& calibration, const InnovationFit& fit) {
  nlohmann::ordered_json json = values_json(calibration);
  json["innovations_before"] = fit.cost_before;
  json["innovations_after"] = fit.cost_after;
  json["held_out_before"] = fit.held_out_before;
  json["held_out_after"] = fit.held_out_after;
  json["improved"] = fit.improved;
  json["runs"] = fit.runs;
  return json;
}

ExitCode write_if_asked(const LocalizeJob& job, const Calibration& calibration, Console& console) {
  if (tells_nothing(calibration)) {
    console.say(
        Error{ErrorCode::NotFound,
              "this drive tells none of the numbers: there is no calibration, and nothing was written",
              {.source = job.logs.front()},
              "What to drive stands beside each of them."});
    return ExitCode::SomeFailed;
  }
  if (job.output.empty()) return ExitCode::Ok;
  if (const Status written = write_calibration(job.output, calibration); !written) {
    console.say(written.error());
    return ExitCode::SomeFailed;
  }
  console.say("wrote " + job.output);
  return ExitCode::Ok;
}

/// The lap tells tags and numbers together; a map holds the tags as surely as it says.
ExitCode calibrate_lap(const CalibrateRobotArgs& args, Console& console) {
  Result<LapCalibration> found = calibrate_recorded_lap(args.job, args.from_s, args.to_s, console);
  if (interrupted()) {
    console.say("stopped: nothing was written");
    return ExitCode::Interrupted;
  }
  if (!found) {
    Error error = found.error();
    if (error.place.source.empty() && error.place.key.empty()) error.place.source = args.job.logs.front();
    console.say(error);
    return ExitCode::SomeFailed;
  }
  found->calibration.provenance.emplace_back("recording", args.job.logs.front());
  nlohmann::ordered_json json = values_json(found->calibration);
  json["tags"] = found->map.map.tags.size();
  json["corners_rms_px"] = found->map.rms_px;
  console.print(args.json
                    ? json_line(json)
                    : values_text(found->calibration) +
                          fmt::format("found together with the places of {} tags; corners within {:.2f} px "
                                      "(rms)\n",
                                      found->map.map.tags.size(), found->map.rms_px));
  return write_if_asked(args.job, found->calibration, console);
}

Status check_span(const CalibrateRobotArgs& args) {
  if (args.from_s < args.to_s) return {};
  return fail(ErrorCode::InvalidArgument,
              fmt::format("nothing lies between --from {:g} s and --to {:g} s", args.from_s, args.to_s),
              {.key = "--to"},
              "The end comes after the beginning; both count from the start of the recording.");
}

Result<LocalizeJob> job_of(const CalibrateRobotArgs& args) {
  LocalizeJob job = args.job;
  if (args.job.map.empty() && args.by == "innovations")
    return fail(ErrorCode::InvalidArgument, "innovations are about tags that are known", {.key = "--by"},
                "Give their map with --map.");
  Status flags = args.filter.apply(job.filter);
  if (flags) flags = args.motion.apply(job.filter.motion);
  const bool of_filter = args.filter.given() || args.motion.given();
  if (flags && of_filter && (args.by == "lap" || args.job.map.empty()))
    flags = fail(ErrorCode::InvalidArgument, "flags of the filter mean nothing where no filter runs",
                 {.key = "--by"}, "Leave them out, or give --by innovations and a --map.");
  if (flags) flags = check_span(args);
  if (!flags) return tl::unexpected(flags.error());
  return job;
}

ExitCode calibrate_robot(const CalibrateRobotArgs& args, Console& console) {
  Result<LocalizeJob> checked = job_of(args);
  if (!checked) {
    console.say(naming_flag(checked.error()));
    return ExitCode::Usage;
  }
  LocalizeJob& job = *checked;
  Status writable = job.output.empty() ? Status() : check_output_file(job.output);
  if (writable && !job.output.empty()) writable = check_calibration_place(job.output);
  if (!writable) {
    console.say(writable.error());
    return ExitCode::SomeFailed;
  }
  // Who says how the filter is to be set means the filter.
  const bool of_filter = args.filter.given() || args.motion.given();
  if (args.by == "lap" || (args.by.empty() && !of_filter && can_calibrate_by_lap(args.job)))
    return calibrate_lap(args, console);
  const auto failed = [&](const Error& error) {
    console.say(error);
    return ExitCode::SomeFailed;
  };
  const Result<LocalizeInputs> inputs = read_localize_inputs(job, console);
  if (!inputs) return failed(inputs.error());
  const std::vector<Sample> samples = within(inputs->samples, args.from_s, args.to_s);
  if (samples.empty())
    return failed({ErrorCode::InvalidArgument,
                   "nothing was recorded between --from and --to",
                   {.source = job.logs.front()},
                   "`waymark info` shows how long it is."});
  int runs = 0;
  InnovationFitOptions options;
  if (inputs->mounting_guessed) options.keep_sigma = 0;  // nothing was given by who knew more
  options.keep_going = [&] {
    console.live(fmt::format("run {} of the filter over the recording, of some twenty", ++runs));
    return !interrupted();
  };
  const Result<InnovationFit> fit = calibrate_by_innovations(
      samples, inputs->setup.landmarks, inputs->setup.eye, inputs->setup.filter, options);
  console.end_progress();
  if (interrupted()) {
    console.say("stopped: nothing was written");
    return ExitCode::Interrupted;
  }
  if (!fit) return failed(fit.error());
  Calibration calibration = calibration_of(*inputs, *fit);
  calibration.provenance.emplace_back("recording", job.logs.front());
  calibration.provenance.emplace_back("map", job.map);
  console.print(args.json ? json_line(calibration_json(calibration, *fit))
                          : calibration_text(calibration, *fit));
  for (const std::string& warning : inputs->warnings) console.say("warning: " + warning);
  if (fit->changed && !fit->improved)
    return failed(
        {ErrorCode::NotFound,
         "the numbers that were found do not fit the drive better, its held-out third included, than those "
         "that were given: nothing was written",
         {.source = job.logs.front()},
         "Record a longer drive at two speeds with turns to both sides. --tag-sigma-m and --point-sigma-m "
         "say how good the map and the observations are."});
  return write_if_asked(job, calibration, console);
}

Run prepare_calibrate_robot(CLI::App& app) {
  const auto args = std::make_shared<CalibrateRobotArgs>(app);
  LocalizeJob& job = args->job;
  app.add_option("LOG", job.logs, "Recordings of one drive past tags")->required()->type_name("");
  app.add_option(
         "--map", job.map,
         "Where the tags are: as for `waymark localize`. Without it they are found together with the rest")
      ->type_name("FILE");
  app.add_option(
         "--by", args->by,
         "How: lap, tags, way and numbers together, the map held as surely as it says; innovations, the "
         "predictions of the filter. Unless given: lap where there are corners of tags and odometry, and "
         "no map or one of ours")
      ->check(CLI::IsMember({"lap", "innovations"}))
      ->type_name("HOW");
  add_frame_flags(app, job.frames);
  app.add_option("--robot", job.robot, "Camera and where it sits, as far as known: a robot's file, or a name")
      ->type_name("FILE");
  app.add_option("--calibration", job.calibration, "calibration.yaml with what is known before (the camera)")
      ->type_name("FILE");
  app.add_option("--tag-size-m", job.tag_size_m, "Size of tags whose map does not say it")
      ->type_name("NUMBER");
  app.add_option("--map-sigma", job.map_sigma_m,
                 "By lap: how well the tags are known of a map that does not say it of any, such as one "
                 "measured by hand [m]")
      ->capture_default_str()
      ->check(CLI::Range(1e-6, 10.0))
      ->type_name("NUMBER");
  app.add_option("--sensor-pose", job.sensor_pose,
                 "Where a sensor sits that measures ranges: x y [m], yaw [deg]")
      ->expected(3)
      ->type_name("NUMBER");
  app.add_option("--from", args->from_s, "Leave out what is earlier, in seconds from the start")
      ->type_name("S");
  app.add_option("--to", args->to_s, "Leave out what is later, in seconds from the start")->type_name("S");
  app.add_option("-o,--output", job.output, "calibration.yaml to write")
      ->check(yaml_name())
      ->type_name("FILE");
  app.add_flag("--json", args->json, "One JSON object instead of a table");
  return [args](Console& console) { return calibrate_robot(*args, console); };
}

}  // namespace

Verb calibrate_robot_verb() {
  return {
      .name = "robot",
      .sentence = "Find where the camera sits, scales, gains and latency from a drive past tags",
      .help =
          R"(No truth is needed. Where a recording has corners of tags and odometry, tags, way and numbers are found together,
with --map from where the tags are known to be. Of other recordings (poses of tags, ranges and bearings) the numbers are
those under which the filter's predictions fit best what was seen, which needs a map. Drive at
two speeds and with turns to both sides, for at one speed a robot that slips looks like one whose camera sits elsewhere. What the drive does not tell is called unobservable, with what to drive instead of a number. Give the
result to `waymark localize --calibration`; judge it on another lap than it was made from (--from, --to).

Exit code: 0 calibrated, 1 it could not be (says why), 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark teach --world circuit24 --speed-m-s 0.3 --second-speed-m-s 1 --wander-m 0.3 --wander-time-s 1.5 --overlap-m 16 -o lap.mcap
  waymark calibrate robot lap.mcap -o calibration.yaml
  waymark calibrate robot lap.mcap --map map/map.yaml -o calibration.yaml
  waymark localize lap.mcap --map map/map.yaml --calibration calibration.yaml
)",
      .prepare = prepare_calibrate_robot,
      .verbs = {}};
}

}  // namespace waymark::cli
