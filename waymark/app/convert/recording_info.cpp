#include "waymark/app/convert/recording_info.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/sensor_finding_fields.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/pipeline/lap_diagnosis.hpp"
#include "waymark/pipeline/lap_mapper.hpp"
#include "waymark/samples/clock_check.hpp"

namespace waymark {
namespace {

/// Adds problems with the recorded camera. Images that cannot be read and depth images do not count as
/// contents.
void add_camera_problems(RecordingInfo& info) {
  const ChosenCamera& chosen = info.setup.chosen;
  bool readable = false;
  bool unreadable = false;
  for (const RecordedView& view : info.setup.facts.views) {
    if (!view.image || chosen.unused.contains(view.topic)) continue;
    (view.error ? unreadable : readable) = true;
    if (view.error) info.problems.push_back({LogProblem::Kind::Trap, "images", *view.error});
  }
  const auto depth = only_depth_images(info.setup.facts);
  if (depth) info.problems.push_back({LogProblem::Kind::Trap, "images", *depth});
  if (depth || (unreadable && !readable)) info.contents.erase("images");
  for (const auto& problem : {chosen.ambiguous, chosen.camera_error, chosen.mounting_error})
    if (problem) info.problems.push_back({LogProblem::Kind::Trap, "camera", *problem});
}

/// Adds the problems with a key that is not known yet.
void add_new(const std::vector<LogProblem>& problems, RecordingInfo& info) {
  for (const LogProblem& problem : problems)
    if (std::ranges::find(info.problems, problem.key, &LogProblem::key) == info.problems.end())
      info.problems.push_back(problem);
}

/// Adds a problem if odometry, IMU data or ground truth are not stamped by the clock of the images. As in a
/// map, only images that are used count, and none if there are tags.
void add_clock_problem(ClockCheck clocks, RecordingInfo& info) {
  const bool has_tags = info.contents.contains("tags") || info.contents.contains("tag_poses");
  for (const RecordedView& view : info.setup.facts.views) {
    if (has_tags || info.setup.chosen.unused.contains(view.topic)) continue;
    const auto topic = std::ranges::find(info.report.topics, view.topic, &TopicReport::topic);
    if (!view.image || topic == info.report.topics.end()) continue;
    for (const std::uint64_t stamp_ns : {topic->stamps.earliest_ns(), topic->stamps.latest_ns()})
      clocks.add(StampedKind::Observations, SensorTime(Duration(static_cast<std::int64_t>(stamp_ns))));
  }
  if (auto mismatch = clocks.mismatch())
    info.problems.push_back({LogProblem::Kind::Trap, "clocks", std::move(mismatch->error)});
}

/// Motion and tags in the recording, as far as they can be read. Images are not decoded.
TaughtLap motion_and_tags(MessageLog& log, const RecordingSetup& setup, const JobControl& control) {
  TaughtLap lap;
  const Status read = log.visit_samples(log.topics_used(setup, false), [&](Sample sample) -> Status {
    if (control.cancelled()) return fail(ErrorCode::Unreadable, "stopped");
    turn_into_base(sample, setup.chosen);
    if (auto* frame = std::get_if<TagFrame>(&sample)) lap.frames.push_back(std::move(*frame));
    if (const auto* odometry = std::get_if<Odometry>(&sample)) lap.odometry.push_back(*odometry);
    if (const auto* imu = std::get_if<ImuSample>(&sample)) lap.imu.push_back(*imu);
    return {};
  });
  return read ? lap : TaughtLap{};
}

SensorDiagnosis diagnose_recording(const TaughtLap& lap, const RecordingSetup& setup) {
  if (lap.frames.empty() || !setup.camera || !setup.base_T_cam)
    return diagnose_sensors({.odometry = lap.odometry, .imu = lap.imu});
  TeachSetup taught{.camera = *setup.camera, .base_T_cam = *setup.base_T_cam};
  taught.more_cameras = setup.more_cameras;
  return diagnose_turns(lap, taught);
}

/// Adds a problem for each fault of a sensor. Scales of the odometry are usual, and maps estimate them.
void add_sensor_problems(MessageLog& log, const JobControl& control, RecordingInfo& info) {
  if (info.quick || !info.contents.contains("odometry")) return;
  SensorDiagnosis diagnosis = diagnose_recording(motion_and_tags(log, info.setup, control), info.setup);
  for (SensorFinding& finding : diagnosis.findings) {
    const SensorFault fault = finding.found.likely.front().fault;
    finding.measure = SensorMeasure::None;
    if (is_odometry_scale(finding)) continue;
    info.problems.push_back({LogProblem::Kind::Trap,
                             std::string(to_string(fault)),
                             {ErrorCode::InvalidArgument, describe(finding)}});
  }
  info.sensors = std::move(diagnosis.findings);
}

}  // namespace

Result<RecordingInfo> look_at(const std::string& file, bool quick, const JobControl& control) {
  Result<std::unique_ptr<MessageLog>> opened = open_recording(file, control);
  if (!opened) return tl::unexpected(opened.error());
  MessageLog& log = **opened;
  RecordingInfo info{.file = file,
                     .format = log.format(),
                     .description = log.description(),
                     .summary = log.summary(),
                     .quick = quick,
                     .attachments = log.attachments()};
  // Use the recorded robot setup, if valid. An invalid camera is reported as a problem, not as an error.
  Result<RecordingSetup> setup = log.setup({.quick = quick});
  // Problems with the messages must be copied before the next visit clears them.
  const std::vector<LogProblem> setup_problems = log.problems();
  if (setup) info.setup = std::move(*setup);
  ClockCheck clocks;
  Result<LogContents> contents = contents_of(log, !quick, &clocks, setup ? &info.setup : nullptr);
  if (!contents) return tl::unexpected(contents.error());
  info.problems = log.problems();
  add_new(setup_problems, info);
  info.contents = std::move(*contents);
  if (quick) {
    info.report = quick_report_on(log);
  } else {
    std::uint64_t first = 0;
    Result<LogReport> report = report_on(log, [&](std::uint64_t log_time) {
      if (first == 0) first = log_time;
      const std::uint64_t since = log_time > first ? log_time - first : 0;
      control.progress({fmt::format("{}: {:.0f} s", file, static_cast<double>(since) * 1e-9)});
      return !control.cancelled();
    });
    if (!report) return tl::unexpected(report.error());
    info.report = std::move(*report);
  }
  add_new(log.problems(), info);
  if (!setup) info.problems.push_back({.key = "setup", .error = setup.error()});
  add_camera_problems(info);
  add_clock_problem(clocks, info);
  add_sensor_problems(log, control, info);
  return info;
}

// Conversion to report fields.
namespace {

struct InfoTopic {
  TopicReport topic{};
  bool quick = false;
};

ReportFields fields(const InfoTopic& listed) {
  const TopicReport& topic = listed.topic;
  const StampStatistics& stamps = topic.stamps;
  const auto unless_quick = [&](const auto& value) {
    return if_any(listed.quick ? std::nullopt : std::optional(value));
  };
  return {
      {"topic", "Name of the topic", topic.topic},
      {"type", "Message type", topic.type},
      {"encoding", "Message encoding", topic.encoding},
      {"messages", "Number of messages", topic.messages},
      {"rate_hz", "Messages per second over the duration of the topic", topic.rate_hz},
      {"stamps",
       "Which stamps were analysed: header, or log (recording times) for types without a stamp; not with "
       "`quick`",
       unless_quick(std::string(topic.has_header ? "header" : "log"))},
      {"periodic", "Whether at least 80 % of the intervals are within 50 % of the median; not with `quick`",
       unless_quick(stamps.periodic())},
      {"gaps", "Number of intervals longer than 1.5 times the median; not with `quick`",
       unless_quick(stamps.gaps())},
      {"dropped", "Approximate number of messages missing in the gaps; not with `quick`",
       unless_quick(stamps.dropped())},
      {"longest_interval_s", "Longest interval between two messages; not with `quick`",
       unless_quick(static_cast<double>(stamps.longest_ns()) * 1e-9)},
      {"duplicate_stamps", "Number of stamps equal to the previous one; not with `quick`",
       unless_quick(stamps.duplicate())},
      {"zero_stamps", "Number of stamps of 0; not with `quick`", unless_quick(stamps.zero())},
      {"backward_stamps", "Number of stamps earlier than the previous one; not with `quick`",
       unless_quick(stamps.backward())},
      {"clock_jumps",
       "Number of jumps of the stamps relative to the log times by more than 0.5 s; not with `quick`",
       unless_quick(topic.clock_jumps)},
      {"largest_clock_jump_s", "Largest clock jump; not with `quick`", unless_quick(topic.largest_jump_s)}};
}

struct InfoAttachment {
  LogAttachment attachment{};
};

ReportFields fields(const InfoAttachment& listed) {
  const LogAttachment& attachment = listed.attachment;
  return {{"name", "File name", attachment.name},
          {"media_type", "Media type", attachment.media_type},
          {"size_bytes", "Size", attachment.size_bytes}};
}

struct InfoTrap {
  LogProblem problem{};
};

ReportFields fields(const InfoTrap& trap) {
  return {{"key", "Stable name of the problem", trap.problem.key},
          {"count", "Number of occurrences", trap.problem.count},
          {"message", "Message, with the place of the first occurrence", to_string(trap.problem.error)}};
}

ReportFields metadata_fields(const RecordingInfo& info) {
  ReportFields blocks;
  for (const auto& [name, values] : info.setup.metadata) {
    ReportFields block;
    for (const auto& [key, value] : values) block.push_back({key, {}, value});
    blocks.push_back({name, {}, block});
  }
  return blocks;
}

}  // namespace

ReportFields fields(const NextStep& step) {
  return {{"sentence", "Possible next step", step.sentence},
          {"command", "Command line; empty if there is none", step.command}};
}

ReportFields fields(const RecordingInfo& info) {
  std::vector<InfoTopic> topics;
  topics.reserve(info.report.topics.size());
  for (const TopicReport& topic : info.report.topics) topics.push_back({topic, info.quick});
  const std::vector<InfoAttachment> attachments(info.attachments.begin(), info.attachments.end());
  std::vector<std::string> problems;
  std::vector<InfoTrap> traps;
  for (const LogProblem& problem : info.problems) {
    if (problem.kind == LogProblem::Kind::Damage)
      problems.push_back(to_string(problem.error));
    else
      traps.push_back({problem});
  }
  return {{"file", "Recording that was read", info.file},
          {"format", "mcap, rosbag2, ros1bag, lcm or csv, detected from the content", to_string(info.format)},
          {"size_bytes", "Total size of the files", info.summary.size_bytes},
          {"library", "MCAP: program that wrote the file", info.summary.library},
          {"profile", "MCAP: profile; ros2 in recordings by Waymark", info.summary.profile},
          {"complete",
           "Whether the file has a summary; if not, it is truncated or being written, and was read in full",
           info.summary.complete},
          {"start_ns", "Log time of the first message", info.report.start_ns},
          {"duration_s", "Time from the first message to the last", info.report.duration_s},
          {"messages", "Number of messages", info.report.messages},
          {"chunks", "MCAP: number of chunks; else 0", info.summary.chunks.value_or(0)},
          {"topics", "Topics, by name", topics},
          {"contents",
           "Kinds of samples in the recording (with `quick`: in its first 10 s), as named by `waymark play`",
           info.contents},
          {"odometry", "ROS: source of the odometry, its topic or /tf with its frames; empty if unknown",
           info.setup.chosen.odometry},
          {"metadata", "Metadata blocks by name, each with its values by key", metadata_fields(info)},
          {"attachments", "Files in the recording", attachments},
          {"problems", "Messages about damage", problems},
          {"traps", "Intact data that are easily misinterpreted", traps},
          {"sensors", kSensorsHelp, info.sensors},
          {"next", "Possible next steps with the recording", next_steps(info)}};
}

// Suggesting next steps.
namespace {

/// Data that are required for a tag map but missing from the recording.
struct MapNeeds {
  std::vector<std::string> flags{};    ///< flags that supply the data
  std::vector<std::string> missing{};  ///< descriptions of the data
};

/// Whether the metadata in the recording contain this key, such as "anchor" or "tag_size_m".
bool is_in_metadata(const RecordingInfo& info, const char* key) {
  const auto block = info.setup.metadata.find("waymark");
  return block != info.setup.metadata.end() && block->second.contains(key);
}

MapNeeds map_needs(const RecordingInfo& info) {
  MapNeeds needs;
  if (!is_in_metadata(info, "anchor")) needs.flags.emplace_back("--anchor tag36h11:0");
  if (!is_in_metadata(info, "tag_size_m")) needs.flags.emplace_back("--tag-size-m 0.16");
  if (!info.setup.camera || !info.setup.base_T_cam) needs.flags.emplace_back("--robot robot.yaml");
  if (info.setup.chosen.ambiguous) needs.flags.emplace_back("--camera-topic TOPIC");
  if (!info.setup.camera) needs.missing.emplace_back("the camera calibration (sensor_msgs/CameraInfo)");
  if (!info.setup.base_T_cam)
    needs.missing.emplace_back(
        "the camera mounting (/tf_static, from the base to the camera's optical frame)");
  return needs;
}

NextStep map_step(const RecordingInfo& info) {
  const MapNeeds needs = map_needs(info);
  const bool detects = !info.contents.contains("tags");
  if (!needs.missing.empty()) {
    return {fmt::format("Make a tag map. The robot file supplies the data missing from the recording: {}.",
                        fmt::join(needs.missing, " and ")),
            fmt::format("waymark map {} {} -o map", shell_word(info.file), fmt::join(needs.flags, " "))};
  }
  return {detects ? "Detect the tags in the images and make a tag map." : "Make a tag map.",
          fmt::format("waymark map {}{}{} -o map", shell_word(info.file), needs.flags.empty() ? "" : " ",
                      fmt::join(needs.flags, " "))};
}

/// A new file in the working directory, because the folder that contains the recording may be read-only.
std::string output_in_working_folder(const RecordingInfo& info, const char* suffix) {
  return shell_word(std::filesystem::path(info.file).filename().string() + suffix);
}

std::string recover_command(const RecordingInfo& info) {
  const std::filesystem::path path(info.file);
  if (!path.has_parent_path()) return "waymark recover " + shell_word(info.file);
  return fmt::format("waymark recover {} -o {}", shell_word(info.file),
                     shell_word(path.stem().string() + ".recovered.mcap"));
}

}  // namespace

std::vector<NextStep> next_steps(const RecordingInfo& info) {
  std::vector<NextStep> steps;
  const auto has = [&](const char* kind) { return info.contents.contains(kind); };
  if (info.format == LogFormat::Mcap && !info.summary.complete)
    steps.push_back({"Restore the missing index.", recover_command(info)});
  if (info.format != LogFormat::Mcap && !info.contents.empty())
    steps.push_back({"Convert the recording to MCAP, which opens quickly and is supported by all tools.",
                     fmt::format("waymark convert {} {}", shell_word(info.file),
                                 output_in_working_folder(info, ".mcap"))});
  if (has("images"))
    steps.push_back({"Detect the tags in the images.", "waymark detect " + shell_word(info.file)});
  const bool moves = has("odometry");
  const bool corners = has("tags") || has("images");
  if (corners && moves) {
    steps.push_back(map_step(info));
  } else if (corners) {
    const std::vector<std::string> missing = map_needs(info).missing;
    steps.push_back(
        {fmt::format("Mapping a lap also requires odometry: pass it as a second file.{}",
                     missing.empty() ? ""
                                     : fmt::format(" The robot file supplies the other missing data: {}.",
                                                   fmt::join(missing, " and "))),
         fmt::format("waymark map {} odometry.csv --robot robot.yaml --tag-size-m 0.16 --anchor "
                     "tag36h11:0 -o map",
                     shell_word(info.file))});
  } else if (moves && has("tag_poses")) {
    steps.push_back({"Make a tag map from the recorded tag poses.",
                     fmt::format("waymark map {}{} -o map", shell_word(info.file),
                                 is_in_metadata(info, "tag_size_m") ? ""
                                 : info.format == LogFormat::Lcm    ? " --tag-size-m 0.054"  // for an MBot
                                                                    : " --tag-size-m 0.16")});
  }
  const char* robot = corners && !(info.setup.camera && info.setup.base_T_cam) ? " --robot robot.yaml" : "";
  if (moves && (corners || has("tag_poses") || has("range_bearing"))) {
    steps.push_back({"Localise the robot in a map of the same place.",
                     fmt::format("waymark localize {} --map map{}", shell_word(info.file), robot)});
  } else if (has("odometry") || has("imu")) {
    steps.push_back({"Localise the robot. Pass the observations from the same drive as a second file.",
                     fmt::format("waymark localize {} detections.csv --map map", shell_word(info.file))});
  }
  if (!info.contents.empty())
    steps.push_back({"Print the samples in real time.", "waymark play " + shell_word(info.file)});
  if (info.contents.empty() && info.report.messages > 0)
    steps.push_back({"Print the messages, although Waymark does not use their types.",
                     "waymark play --messages " + shell_word(info.file)});
  return steps;
}

// Text output.
namespace {

/// A date if the timestamps are times since 1970; otherwise seconds on the robot's clock.
std::string start_text(std::uint64_t start_ns) {
  constexpr std::uint64_t kYear2000 = 946'684'800;
  constexpr std::uint64_t kSecond = 1'000'000'000;
  const std::uint64_t seconds = start_ns / kSecond;
  if (seconds < kYear2000)
    return fmt::format("{:.3f} s on the robot's clock", static_cast<double>(start_ns) * 1e-9);
  const std::chrono::sys_seconds when{std::chrono::seconds(static_cast<std::int64_t>(seconds))};
  return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(std::chrono::system_clock::to_time_t(when)));
}

std::string head_text(const RecordingInfo& info) {
  const std::string chunks = info.summary.chunks ? fmt::format(" in {} chunks", *info.summary.chunks) : "";
  std::string text = fmt::format(
      "{}: {:.1f} KiB, {} messages{}\n"
      "format      {}\n",
      info.file, static_cast<double>(info.summary.size_bytes) / 1024, info.report.messages, chunks,
      info.description);
  if (!info.summary.library.empty()) text += fmt::format("written by  {}\n", info.summary.library);
  if (info.setup.chosen.odometry_frames) text += fmt::format("odometry    {}\n", info.setup.chosen.odometry);
  return text + fmt::format("start       {}\nduration    {:.3f} s\n", start_text(info.report.start_ns),
                            info.report.duration_s);
}

std::string topics_text(const RecordingInfo& info) {
  std::size_t topic_width = 5;
  std::size_t type_width = 4;
  for (const TopicReport& t : info.report.topics) {
    topic_width = std::max(topic_width, t.topic.size());
    type_width = std::max(type_width, t.type.size());
  }
  std::string text = fmt::format("\n{:<{}}  {:<{}}  {:>9}  {:>8}\n", "topic", topic_width, "type", type_width,
                                 "messages", "Hz");
  for (const TopicReport& t : info.report.topics) {
    text += fmt::format("{:<{}}  {:<{}}  {:>9}  {:>8}\n", t.topic, topic_width, t.type, type_width,
                        t.messages, t.rate_hz > 0 ? fmt::format("{:.1f}", t.rate_hz) : "");
  }
  return text;
}

/// Defects in the timestamps of a topic. Empty if there are none.
std::string stamps_text(const TopicReport& topic) {
  std::vector<std::string> defects;
  const StampStatistics& stamps = topic.stamps;
  if (stamps.gaps() > 0)
    defects.push_back(fmt::format("about {} missing in {}, the longest {:.2f} s",
                                  counted(stamps.dropped(), "message"), counted(stamps.gaps(), "gap"),
                                  static_cast<double>(stamps.longest_ns()) * 1e-9));
  const auto count = [&](std::uint64_t n, const char* what) {
    if (n > 0) defects.push_back(fmt::format("{} {}", n, what));
  };
  count(stamps.zero(), "zero stamps");
  count(stamps.duplicate(), "duplicate stamps");
  count(stamps.backward(), "stamps out of order");
  if (topic.clock_jumps > 0)
    defects.push_back(
        fmt::format("{}, by up to {:.2f} s", counted(topic.clock_jumps, "clock jump"), topic.largest_jump_s));
  return defects.empty() ? "" : fmt::format("  {}: {}\n", topic.topic, fmt::join(defects, "; "));
}

}  // namespace

std::string to_text(const RecordingInfo& info) {
  std::string text = head_text(info) + topics_text(info);
  std::string stamps;
  if (!info.quick)
    for (const TopicReport& topic : info.report.topics) stamps += stamps_text(topic);
  if (!stamps.empty()) text += "\nstamps\n" + stamps;
  for (const auto& [name, values] : info.setup.metadata) {
    text += fmt::format("\nmetadata {}\n", name);
    for (const auto& [key, value] : values) text += fmt::format("  {}: {}\n", key, value);
  }
  if (!info.attachments.empty()) text += "\nattachments\n";
  for (const LogAttachment& a : info.attachments)
    text += fmt::format("  {} ({}, {} bytes)\n", a.name, a.media_type, a.size_bytes);
  const std::vector<NextStep> steps = next_steps(info);
  if (!steps.empty()) text += "\nnext\n";
  for (const NextStep& step : steps)
    text += fmt::format("  {}\n{}", step.sentence, step.command.empty() ? "" : "    " + step.command + "\n");
  return text;
}

}  // namespace waymark
