#include "waymark/app/doctor/doctor.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/doctor/robot_checks.hpp"
#include "waymark/app/doctor/tag_checks.hpp"
#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

/// The calibration specified by the user, or else calibration.yaml in the current folder.
std::string calibration_file(const DoctorJob& job) {
  std::error_code ignored;
  const std::string found = std::filesystem::exists("calibration.yaml", ignored) ? "calibration.yaml" : "";
  return job.calibration.empty() ? found : job.calibration;
}

DoctorLine calibration_line(const std::string& file) {
  if (!file.empty()) return check_calibration(file, std::filesystem::file_time_type::clock::now());
  return {"calibration", DoctorLevel::Warn, "no calibration given, and calibration.yaml does not exist here",
          "waymark doctor camera=FILE"};
}

/// The checks for one kind of robot. They do not move it.
struct RobotCheck {
  std::string_view kind;
  std::vector<DoctorLine> (*check)(const std::string& address, const DoctorCancelled& cancelled);
};
constexpr std::array kRobotChecks = {RobotCheck{"ros2", check_ros2}, RobotCheck{"limo", check_limo},
                                     RobotCheck{"mbot", check_mbot}, RobotCheck{"gazebo", check_gazebo}};

/// The lines for a robot `KIND:ADDRESS`. Fails if the kind is unknown or has no checks.
Result<std::vector<DoctorLine>> check_robot(const std::string& robot, const DoctorCancelled& cancelled) {
  std::vector<std::string> names;
  for (const RobotKind& kind : robot_kinds()) {
    const auto* const row = std::ranges::find(kRobotChecks, kind.name, &RobotCheck::kind);
    if (row == kRobotChecks.end()) continue;
    const std::string begin = std::string(kind.name) + ":";
    if (robot.starts_with(begin)) {
      const auto start = kind.start(robot.substr(begin.size()), "");  // fails if the address is invalid
      if (!start) return tl::unexpected(start.error());
      return row->check(robot.substr(begin.size()), cancelled);
    }
    names.push_back(begin + std::string(kind.address));
  }
  return fail(ErrorCode::InvalidArgument, "no checks for a robot '" + robot + "'", {.key = "robot"},
              suggestion(robot, names));
}

/// Runs the loop trial and reports its result.
Result<DoctorLine> processor_line(const LoopTrial& trial, const DoctorCancelled& cancelled) {
  const auto finder = make_tag_finder();
  if (!finder) return tl::unexpected(finder.error());
  const auto tried = try_loop(*finder, trial, cancelled);
  if (!tried) return tl::unexpected(tried.error());
  return check_processor(trial, *tried);
}

}  // namespace

Result<DoctorReport> run_doctor(const DoctorJob& job, const DoctorCancelled& cancelled) {
  std::vector<DoctorLine> lines;
  const std::vector<CameraDevice> cameras = list_cameras();
  if (!cameras.empty() || job.sources.empty()) lines = check_cameras(cameras);
  if (!job.robot.empty()) {
    auto found = check_robot(job.robot, cancelled);
    if (!found) return tl::unexpected(found.error());
    lines.insert(lines.begin(), found->begin(), found->end());
  }
  for (DoctorLine& line : check_devices()) lines.push_back(std::move(line));
  for (const std::string& source : job.sources) lines.push_back(check_live_camera(source, cancelled));
  const std::string calibration = calibration_file(job);
  lines.push_back(calibration_line(calibration));
  if (job.tag.distance_m > 0)
    for (const std::string& source : job.sources)
      lines.push_back(check_tag_size(source, calibration, job.tag, cancelled));
  if (!job.map.empty())
    for (const std::string& source : job.sources)
      lines.push_back(check_map_tags(source, calibration, job.map, cancelled));
  lines.push_back(check_disk(job.folder));
  if (job.sources.empty() && finds_tags_itself(job.robot)) {
    lines.push_back({"processor", DoctorLevel::Ok, "not tested: the robot detects tags itself", ""});
  } else {
    auto line = processor_line(job.trial, cancelled);
    if (!line) return tl::unexpected(line.error());
    lines.push_back(std::move(*line));
  }
  if (cancelled()) return fail(ErrorCode::LimitExceeded, "stopped before all checks were done");
  return DoctorReport{std::move(lines)};
}

bool any_failed(const DoctorReport& report) {
  return std::ranges::find(report.checks, DoctorLevel::Fail, &DoctorLine::level) != report.checks.end();
}

std::string to_text(const DoctorReport& report) {
  std::string text;
  for (const DoctorLine& line : report.checks) {
    text += fmt::format("{:<5} {:<12} {}\n", to_string(line.level), line.key, line.message);
    if (!line.command.empty()) text += fmt::format("{:<19}{}\n", "", line.command);
  }
  return text;
}

ReportFields fields(const DoctorLine& line) {
  return {{"check", "Name of the check: camera, calibration, robot, map, disk, processor, ...", line.key},
          {"level", "ok, warn or fail", to_string(line.level)},
          {"message", "Result as a sentence", line.message},
          {"command", "Command that fixes it or prints more; empty: nothing to fix", line.command}};
}

ReportFields fields(const DoctorReport& report) { return {{"checks", "One entry per check", report.checks}}; }

}  // namespace waymark
