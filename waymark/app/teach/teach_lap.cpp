#include "waymark/app/teach/teach_lap.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/output_files.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/app/live/live_robot.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/robots/simulated/script_driver.hpp"
#include "waymark/runtime/teach_session.hpp"

namespace waymark {
namespace {

/// The driver and camera options for the recording, as YAML.
std::string making_yaml(const SimulatedSetup& setup, const TeachJob& job, const DriverOptions& driver) {
  std::string yaml =
      "driver:\n" +
      (job.driver == "scripted" ? write_fields(driver, 2) : fmt::format("  speed_m_s: {}\n", job.speed_m_s));
  if (setup.images)
    yaml += "camera:\n" + write_fields(setup.images->camera, 2) + "scene:\n" +
            write_fields(setup.images->scene, 2) + "detector:\n" + write_fields(setup.images->detector, 2);
  return yaml;
}

/// The driver of a simulated lap: a person in real time, or a script that uses the robot's ground truth.
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

/// The topic with the ground truth for images, which no estimator reads.
std::string truth_topic(const std::string& camera) {
  return "/truth" + topic_of_camera(camera, topics::kTags);
}

/// The exact corners of all tags that are completely visible.
TagFrame true_corners(const SeenImage& seen) {
  TagFrame frame{.stamp = seen.found.stamp, .camera = seen.found.camera};
  for (const SceneTagTruth& tag : seen.frame.tags) {
    if (std::ranges::count(tag.corner_visible, true) < 4) continue;
    frame.detections.push_back({.tag = tag.tag, .hamming = 0, .corners_px = tag.corners_px});
  }
  return frame;
}

/// Records a rendered image and its ground truth; the tags detected in it are recorded as a sample of the
/// lap.
Status record_rendered(const SeenImage& seen, const std::string& images, SampleRecorder& recorder) {
  Status status = recorder.add_message(truth_topic(seen.found.camera), seen.found.stamp,
                                       ros2::to_ros(true_corners(seen)));
  if (!status || images.empty()) return status;
  return record_image({.stamp = seen.found.stamp, .camera = seen.found.camera, .image = seen.frame.image},
                      images, recorder);
}

TeachReport report_of(const TeachJob& job, const LapMonitor& lap, const LapEnd& end, const Stopwatch& watch) {
  return {.file = job.output,
          .summary = lap.summary(),
          .end = end,
          .worst_blur_px = lap.monitor().worst_blur_px(),
          .blurred_frames = lap.monitor().blurred_frames(),
          .abrupt_moments = lap.monitor().abrupt_moments(),
          .wall_s = watch.seconds()};
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
  listener.on_image = [&](const SeenImage& seen) { return record_rendered(seen, job.images, *recorder); };
  listener.should_stop = control.cancelled;
  if (const std::string usage = who->driver->usage(); !usage.empty()) control.note(usage);
  const auto end = drive(simulated, *who, session, listener);
  const Status closed = recorder->close();
  if (!end) return tl::unexpected(end.error());
  if (!closed) return tl::unexpected(closed.error());
  return report_of(job, session.lap(), *end, watch);
}

Result<TeachReport> teach_process(const RobotSetup& setup, const TeachJob& job, const JobControl& control) {
  const Stopwatch watch;
  const auto driver = make_lap_driver(job.driver, job.speed_m_s, setup.simulated);
  if (!driver) return tl::unexpected(driver.error());
  // Open the file before the robot starts, so that an unwritable one is reported before the drive.
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
  const Status closed = recorder->close();              // also after an error, to keep what has been recorded
  const bool hung_up = !driven && control.cancelled();  // the terminal was closed
  if (!driven && driven.error().place.key == "driver")
    fresh.discard();  // discard the recording if nothing
                      // was driven
  if (!driven && !hung_up) return tl::unexpected(driven.error());
  fresh.keep();
  if (!closed) return tl::unexpected(closed.error());
  const LapEnd end =
      hung_up ? LapEnd{.finished = session.finished(), .interrupted = true} : session.end(*driven);
  return report_of(job, session.lap(), end, watch);
}

}  // namespace

Status check_teach(const TeachJob& job, const RobotSetup& setup) {
  const RobotModel& robot = setup.simulated.model;
  const double limit_m_s = robot.limits.speed_m_s;
  const std::string too_fast = fmt::format("above the maximum speed of {}, {:g} m/s", robot.name, limit_m_s);
  if (job.speed_m_s > limit_m_s)
    return fail(ErrorCode::InvalidArgument, too_fast, {.key = "speed_m_s"},
                "Reduce the speed, or raise limits: speed_m_s in your own robot file.");
  if (job.second_speed_m_s > limit_m_s)
    return fail(ErrorCode::InvalidArgument, too_fast, {.key = "second_speed_m_s"}, "Reduce the speed.");
  if (job.second_speed_m_s > 0 && (job.driver != "scripted" || !setup.process.empty()))
    return fail(ErrorCode::InvalidArgument,
                "only the scripted driver of a simulated robot alternates between two speeds",
                {.key = "second_speed_m_s"}, "Omit `second_speed_m_s` and drive at two speeds by hand.");
  return check_recorded_images(setup.may_have_images(), job.images);
}

Result<TeachReport> teach_lap(const RobotSetup& setup, const TeachJob& job, const JobControl& control) {
  return setup.process.empty() ? teach_simulated(setup, job, control) : teach_process(setup, job, control);
}

Status check_effects(const TeachJob& job, const RobotSetup& setup, const GivenFields& given) {
  const bool process = !setup.process.empty();
  FieldRefusals refused(given);
  refused.fields(process || job.driver != "scripted", {"wander_m", "wander_time_s", "overlap_m"},
                 "only applies to the scripted driver of a simulated robot", "Omit this option.");
  refuse_seed(process && job.driver != "scripted", refused);
  return refused.status();
}

TeachListener lap_listener(SampleRecorder& recorder, const std::string& images, const JobControl& control) {
  return {.on_sample =
              [&recorder, images](const Sample& sample) {
                const auto* image = std::get_if<CameraFrame>(&sample);
                return image != nullptr ? record_image(*image, images, recorder) : recorder.add(sample);
              },
          .on_progress = [&control](const std::string& line) { control.progress({.text = line}); },
          .on_message = [&control](const std::string& words) { control.note(words); }};
}

LapMonitor lap_of(const SimulatedSetup& setup, TeachListener listener) {
  const auto exposure_ms = setup.images ? std::optional(setup.images->camera.exposure_ms) : std::nullopt;
  return {teach_setup(setup), monitor_options(setup.camera, exposure_ms), std::move(listener)};
}

namespace {

/// A pair of tags connected by too few frames.
struct WeakLink {
  WeakLink() = default;
  explicit WeakLink(const TagLink& link)
      : tags{to_string(link.first), to_string(link.second)}, frames(link.frames) {}

  std::array<std::string, 2> tags{};
  int frames = 0;
};

ReportFields fields(const WeakLink& link) {
  return {{"tags", "The two tags", link.tags}, {"frames", "Frames that show both", link.frames}};
}

}  // namespace

std::string to_text(const TeachReport& report, bool loop) {
  const TeachSummary& s = report.summary;
  std::string text = fmt::format(
      "{}: {:.1f} s, {:.2f} m by odometry, {} frames\n"
      "{} tags, {} detections, two or more tags in {:.1f} % of the frames ({} frames with fewer)\n",
      report.file, report.end.lap_s, s.distance_m, s.frames, s.seen.size(), s.detections,
      100 * s.two_tags_fraction(), s.low_observability_frames);
  if (s.unreliable > 0)
    text +=
        fmt::format("{} with unreliable corners are not used\n", counted(s.unreliable, "further detection"));
  if (s.closed_loop || loop)
    text += s.closed_loop ? "The loop is closed: the anchor was observed at the start and at the end.\n"
                          : "The loop is not closed.\n";
  if (!s.seen.empty()) {
    const auto fewest = std::ranges::min_element(s.seen, {}, [](const auto& seen) { return seen.second; });
    text += fmt::format("Every tag was observed in at least {} frames ({} in fewest).\n", fewest->second,
                        to_string(fewest->first));
  }
  if (s.seen.empty()) return text + "No tag was observed: the lap cannot be mapped.\n";
  text += s.mappable
              ? fmt::format("The lap can be mapped: `waymark map {} output=map`\n", shell_word(report.file))
              : "The map of this lap would be inaccurate: see the warnings. `waymark map` makes the best "
                "possible map.\n";
  return text;
}

ReportFields fields(const TeachReport& report) {
  const TeachSummary& s = report.summary;
  const std::vector<WeakLink> weak_links(s.weak_links.begin(), s.weak_links.end());
  return {{"file", "Recording that was written", report.file},
          {"wall_s", "Elapsed real time", report.wall_s},
          {"lap_s", "Duration of the lap by the robot's clock", report.end.lap_s},
          {"frames", "Camera frames", s.frames},
          {"detections", "Detections of tags in all frames", s.detections},
          {"unreliable_detections", "Further detections, with unreliable corners", s.unreliable},
          {"tags", "Different tags that were detected", s.seen.size()},
          {"low_observability_frames", "Frames with fewer than two tags", s.low_observability_frames},
          {"two_tags_fraction", "Share of the frames with two or more tags", s.two_tags_fraction()},
          {"longest_blind_s", "Longest time without a single tag", s.longest_blind_s},
          {"longest_silence_s", "Longest time without any sample", s.longest_silence_s},
          {"clock_back_s", "Largest backward jump of the sensors' clock; 0: none", s.clock_back_s},
          {"odometry_jumps", "Number of times that the odometry was reset", s.odometry_jumps},
          {"clocks_apart_s",
           "Time between the beginnings of odometry and images, if they are stamped by two clocks",
           if_any(s.clocks_apart_s)},
          {"sideways_deg",
           "Largest angle between heading and direction of motion by odometry, if the robot moved sideways",
           if_any(part(s.sideways,
                       [](const SidewaysMotion& motion) { return to_degrees(std::abs(motion.angle_rad)); }))},
          {"min_clearance_m",
           "Smallest distance in space from the hull to a tag, by odometry; null if no tag was near",
           part(s.nearest_tag, &NearestTag::clearance_m)},
          {"distance_m", "Driven distance, by odometry", s.distance_m},
          {"worst_blur_px", "Largest motion blur, from yaw rate, exposure time and focal length",
           report.worst_blur_px},
          {"blurred_frames", "Frames with more motion blur than 2 px", report.blurred_frames},
          {"abrupt_moments", "Number of abrupt starts and stops", report.abrupt_moments},
          {"weak_links", "Tag pairs that the map depends on and that few frames connect, weakest first",
           weak_links},
          {"closed_loop", "Anchor observed at the start and at the end, from nearly the same position",
           s.closed_loop},
          {"mappable",
           "Lap can be mapped: anchor and another tag observed, no jumps, loop closed (open line: 0.5 m)",
           s.mappable},
          {"finished", "The driver completed the lap", report.end.finished},
          {"warnings", "Problems that make the map less accurate", s.warnings}};
}

}  // namespace waymark
