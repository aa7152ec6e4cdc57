#include "waymark/app/common/trajectory_files.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/estimate_message.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/image_files.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/evaluation/csv.hpp"
#include "waymark/recording/logged_poses.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {

// Reads what `waymark localize` records in addition to poses.
namespace {

std::optional<double> number_of(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// NIS divided by its degrees of freedom; `nullopt` if the status lacks either value.
std::optional<double> nis_of(const ros2::DiagnosticStatus& status) {
  std::optional<double> nis;
  std::optional<double> freedom;
  for (const auto& value : status.values) {
    if (value.key == "nis") nis = number_of(value.value);
    if (value.key == "degrees_of_freedom") freedom = number_of(value.value);
  }
  if (!nis || !freedom || !(*freedom > 0)) return std::nullopt;
  return *nis / *freedom;
}

}  // namespace

std::optional<NisSummary> read_nis(const std::string& path, SensorTime from, SensorTime to,
                                   const JobControl& control) {
  if (!is_recording(kind_of(path))) return std::nullopt;
  const auto log = open_log(path, control.log_options());
  if (!log) return std::nullopt;
  NisSummary all;
  double sum = 0;
  const Status read = (*log)->visit({.topics = {kNisTopic}},
                                    [&](const LogChannel& channel, const LogMessage& message) -> Status {
                                      if (channel.type != ros2::DiagnosticArray::kType) return {};
                                      const auto array = cdr::decode<ros2::DiagnosticArray>(message.data);
                                      if (!array) return {};
                                      const SensorTime stamp = ros2::from_ros(array->header.stamp);
                                      if (stamp < from || stamp > to) return {};
                                      for (const ros2::DiagnosticStatus& status : array->status) {
                                        const auto nis = nis_of(status);
                                        if (!nis) continue;
                                        const bool accepted = status.level == 0;
                                        sum += accepted ? *nis : 0;
                                        ++(accepted ? all.observations : all.rejected);
                                      }
                                      return {};
                                    });
  if (!read || all.observations + all.rejected == 0) return std::nullopt;
  if (all.observations > 0) all.mean = sum / static_cast<double>(all.observations);
  return all;
}

std::size_t count_uncertain(const std::string& path, SensorTime from, SensorTime to,
                            const JobControl& control) {
  if (!is_recording(kind_of(path))) return 0;
  const auto log = open_log(path, control.log_options());
  if (!log || (*log)->format() != LogFormat::Mcap) return 0;
  std::size_t count = 0;
  std::vector<LogProblem> problems;
  const Status read = visit_poses(
      **log, kUncertainTopic, {},
      [&](const EstimatedPose& pose) -> Status {
        if (pose.stamp >= from && pose.stamp <= to) ++count;
        return {};
      },
      problems);
  return read ? count : 0;
}

namespace {

Result<FloorPath> corners_of(const CsvTable& table, bool closed) {
  const auto x = table.column("x_m");
  const auto y = table.column("y_m");
  if (!x || !y)
    return fail(ErrorCode::Unreadable, "no columns x_m and y_m", {.source = table.source, .line = 1},
                "A path is a CSV file with these columns; a trajectory also has t_s.");
  FloorPath path{.corners = {}, .closed = closed};
  for (const CsvRow& row : table.rows) {
    const Result<double> x_m = csv_number(table, row, *x);
    const Result<double> y_m = csv_number(table, row, *y);
    if (!x_m) return tl::unexpected(x_m.error());
    if (!y_m) return tl::unexpected(y_m.error());
    path.corners.emplace_back(*x_m, *y_m);
  }
  if (path.corners.size() < 2)
    return fail(ErrorCode::Unreadable, "a path needs at least two points", {.source = table.source});
  return path;
}

Result<std::string> choose_topic(const MessageLog& log, const std::string& path, const std::string& requested,
                                 const std::string& usual) {
  const std::vector<std::string> topics = pose_topics(log);
  const auto has = [&](const std::string& topic) { return std::ranges::find(topics, topic) != topics.end(); };
  if (!requested.empty() && has(requested)) return requested;
  if (!requested.empty())
    return fail(ErrorCode::NotFound, fmt::format("no poses on topic '{}'", requested), {.source = path},
                suggestion(requested, topics));
  if (has(usual)) return usual;
  if (topics.size() == 1) return topics.front();
  if (topics.empty())
    return fail(ErrorCode::NotFound, "no topic with poses", {.source = path},
                "`waymark localize` writes a recording with one; `waymark info` lists topics.");
  return fail(ErrorCode::InvalidArgument,
              fmt::format("several topics contain poses: {}", fmt::join(topics, ", ")), {.source = path},
              "Select one with `est_topic` or `ref_topic`.");
}

Result<EstimatedTrajectory> poses_of_log(const std::string& path, const std::string& requested,
                                         const std::string& usual, const JobControl& control) {
  const auto log = open_log(path, control.log_options());
  if (!log) return tl::unexpected(log.error());
  const Result<std::string> topic = choose_topic(**log, path, requested, usual);
  if (!topic) return tl::unexpected(topic.error());
  EstimatedTrajectory poses;
  std::vector<LogProblem> problems;
  const Status read = visit_poses(
      **log, *topic, {},
      [&](const EstimatedPose& pose) -> Status {
        poses.push_back(pose);
        return control.go_on();
      },
      problems);
  if (!read) return tl::unexpected(read.error());
  if (poses.empty())
    return fail(ErrorCode::NotFound, fmt::format("no poses on topic '{}'", *topic), {.source = path});
  std::ranges::stable_sort(poses, {}, &EstimatedPose::stamp);
  return poses;
}

EstimatedTrajectory without_covariance(const Trajectory& trajectory) {
  EstimatedTrajectory poses;
  for (const StampedPose& pose : trajectory) poses.push_back({pose.stamp, pose.map_T_base, {}});
  return poses;
}

Trajectory poses_alone(const EstimatedTrajectory& estimated) {
  Trajectory trajectory;
  for (const EstimatedPose& pose : estimated)
    if (trajectory.empty() || trajectory.back().stamp < pose.stamp)
      trajectory.push_back({pose.stamp, pose.map_T_base});
  return trajectory;
}

Reference with_path(Trajectory timed) {
  constexpr double kStepMetres = 0.01;
  FloorPath path = floor_path(timed, kStepMetres);
  return {.timed = std::move(timed), .path = std::move(path)};
}

Result<Reference> path_of_route(std::string_view text, const std::string& path, bool closed) {
  const Result<Route> route = parse_route(text, path);
  if (!route) return tl::unexpected(route.error());
  Reference reference;
  reference.path.closed = closed || route->closed;
  for (const RoutePoint& point : route->points)
    reference.path.corners.push_back(point.map_T_base.translation());
  return reference;
}

Result<Reference> reference_of_log(const std::string& path, const std::string& topic,
                                   const JobControl& control) {
  const auto poses = poses_of_log(path, topic, topics::kTruth, control);
  if (!poses) return tl::unexpected(poses.error());
  return with_path(poses_alone(*poses));
}

/// Fails on an empty file.
Result<std::string> read_whole_text(const std::string& path) {
  Result<std::string> text = read_text_file(path, kMaxTextBytes);
  if (text && text->find_first_not_of(" \t\r\n") == std::string::npos)
    return fail(ErrorCode::NotFound, "the file is empty", {.source = path},
                "Write it again, or choose another file.");
  return text;
}

Result<Reference> timed_reference(std::string_view text, const std::string& path) {
  Result<Trajectory> trajectory = parse_trajectory(text, path);
  if (!trajectory) return tl::unexpected(trajectory.error());
  if (trajectory->empty()) return fail(ErrorCode::NotFound, "no poses", {.source = path});
  return with_path(std::move(*trajectory));
}

Result<Reference> path_of_table(std::string_view text, const std::string& path, bool closed) {
  const Result<CsvTable> table = parse_csv(text, path);
  if (!table) return tl::unexpected(table.error());
  Result<FloorPath> corners = corners_of(*table, closed);
  if (!corners) return tl::unexpected(corners.error());
  return Reference{{}, std::move(*corners)};
}

/// Folders are always opened as recordings.
bool is_log(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored) || is_recording(kind_of(path));
}

Result<EstimatedTrajectory> estimate_of(const std::string& path, const std::string& topic,
                                        const JobControl& control) {
  if (is_log(path)) return poses_of_log(path, topic, topics::kEstimate, control);
  const Result<std::string> text = read_whole_text(path);
  if (!text) return tl::unexpected(text.error());
  if (is_table_kind(kind_of_content(*text, path)))
    return poses_of_log(path, topic, topics::kEstimate, control);
  const Result<Trajectory> trajectory = parse_trajectory(*text, path);
  if (!trajectory) return tl::unexpected(trajectory.error());
  if (trajectory->empty()) return fail(ErrorCode::NotFound, "no poses", {.source = path});
  return without_covariance(*trajectory);
}

Result<Reference> reference_of(const std::string& path, const std::string& topic, bool closed,
                               const JobControl& control) {
  if (is_log(path)) return reference_of_log(path, topic, control);
  const Result<std::string> text = read_whole_text(path);
  if (!text) return tl::unexpected(text.error());
  const FileKind kind = kind_of_content(*text, path);
  if (kind == FileKind::CsvLog) return reference_of_log(path, topic, control);
  if (is_table_kind(kind)) return path_of_table(*text, path, closed);
  return kind == FileKind::Route ? path_of_route(*text, path, closed) : timed_reference(*text, path);
}

}  // namespace

Result<EstimatedTrajectory> read_estimate(const std::string& path, const std::string& topic,
                                          const JobControl& control) {
  return or_wrong_kind(estimate_of(path, topic, control), path, FileUse::Estimate);
}

Result<Reference> read_reference(const std::string& path, const std::string& topic, bool closed,
                                 const JobControl& control) {
  return or_wrong_kind(reference_of(path, topic, closed, control), path, FileUse::Reference);
}

Result<Motion> read_motion(const std::string& path, const JobControl& control) {
  const auto log = open_recording(path, control);
  if (!log) return tl::unexpected(log.error());
  Motion motion;
  const Status read = (*log)->visit_samples({}, [&](const Sample& sample) -> Status {
    if (const auto* odometry = std::get_if<Odometry>(&sample)) motion.odometry.push_back(*odometry);
    if (const auto* imu = std::get_if<ImuSample>(&sample)) motion.imu.push_back(*imu);
    return control.go_on();
  });
  if (!read) return tl::unexpected(read.error());
  if (motion.odometry.empty())
    return fail(ErrorCode::NotFound, "the recording contains no odometry", {.source = path});
  std::ranges::stable_sort(motion.odometry, {}, &Odometry::stamp);
  std::ranges::stable_sort(motion.imu, {}, &ImuSample::stamp);
  return motion;
}

}  // namespace waymark
