#include "waymark/app/commission/commission.hpp"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <filesystem>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/commission/first_drive.hpp"
#include "waymark/app/commission/typed_line.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

bool nothing_failed(const CommissionReport& report) {
  return std::ranges::none_of(report.findings, [](const CommissionFinding& finding) {
    return finding.line.verdict == CommissionVerdict::Fail;
  });
}

/// The steps, until one fails. Whether the last one was taken.
Result<bool> take_steps(FirstDrive& drive, const CommissionJob& job) {
  Status status;
  if (!job.skip_lifted) {
    status = drive.drive_lifted();
    if (status && nothing_failed(drive.report())) status = drive.try_stops();
    if (!status) return tl::unexpected(status.error());
    if (!nothing_failed(drive.report())) return false;
  }
  status = drive.drive_on_floor();
  if (status && job.skip_lifted && nothing_failed(drive.report())) status = drive.try_stops();
  if (!status) return tl::unexpected(status.error());
  return true;
}

CommissionRecord record_of(const CommissionReport& report, const RobotSetup& setup) {
  const RobotModel& model = setup.simulated.model;
  CommissionRecord record{.passed = report.passed,
                          .date = fmt::format("{:%Y-%m-%d}", fmt::gmtime(std::chrono::system_clock::now())),
                          .version = WAYMARK_VERSION,
                          .robot = setup.ground.robot,
                          .topics = setup.ground.topics,
                          .limits = model.limits,
                          .wheel_radius_m = model.wheel_radius_m,
                          .track_m = model.track_m,
                          .figures = report.figures};
  for (const CommissionFinding& finding : report.findings) {
    const bool known = std::ranges::find(record.failed, finding.line.key) != record.failed.end();
    if (finding.line.verdict == CommissionVerdict::Fail && !known) record.failed.push_back(finding.line.key);
  }
  return record;
}

/// Keeps what is there under the first free number.
Result<std::string> keep(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return std::string();
  for (int number = 1;; ++number) {
    const fs::path name = file.string() + fmt::format(".{}", number);
    if (fs::exists(name, error)) continue;
    fs::copy_file(file, name, error);
    if (!error) return name.string();
    return fail(ErrorCode::Unwritable, "the robot's file cannot be kept: " + error.message(),
                {.source = name.string()}, "Name another file with -o.");
  }
}

Status write_result(CommissionReport& report, const RobotSetup& setup, const CommissionJob& job) {
  if (!report.real && job.output.empty()) return {};
  const fs::path file = job.output.empty() ? commission_file(setup) : job.output;
  const auto text = with_commission(setup.robot_yaml, record_of(report, setup));
  if (!text) return tl::unexpected(text.error());
  auto kept = keep(file);
  if (!kept) return tl::unexpected(kept.error());
  if (Status written = write_text_file(file, *text); !written) return written;
  report.file = file.string();
  report.kept = std::move(*kept);
  return {};
}

}  // namespace

std::string commission_file(const RobotSetup& setup) {
  const fs::path path(setup.robot_path);
  const auto shared = find_shared("robots", path.stem().string());
  std::error_code ignored;
  const bool ours = shared && fs::equivalent(*shared, path, ignored);
  return ours ? path.filename().string() : path.string();
}

CommissionPerson person_at_terminal(const JobControl& control) {
  CommissionPerson person;
  person.there = true;
  person.ready = [control](const std::string& words) -> Status {
    control.note(words + " Then press Enter (Ctrl-C ends).");
    const auto line = typed_line(control.cancelled);
    return line ? Status() : tl::unexpected(line.error());
  };
  person.saw = [control](const std::string& question) -> Seen {
    control.note(question + " y or n, Enter where you did not see it");
    const auto line = typed_line(control.cancelled);
    if (!line || line->empty()) return {};
    const int answer = std::tolower(static_cast<unsigned char>(line->front()));
    return answer == 'y' ? Seen(true) : answer == 'n' ? Seen(false) : Seen();
  };
  return person;
}

Result<CommissionReport> commission(const RobotSetup& setup, const CommissionJob& job,
                                    const CommissionPerson& person, const JobControl& control) {
  if (!job.output.empty())
    if (Status writable = check_output_file(job.output); !writable) return tl::unexpected(writable.error());
  FirstDrive drive(setup, job, person, control);
  const Result<bool> done = take_steps(drive, job);
  CommissionReport report = std::move(drive.report());
  report.interrupted = control.cancelled();
  if (report.interrupted) return report;
  if (!done) {
    const Error& error = done.error();
    const bool of_message = !error.place.key.empty() && !error.place.key.starts_with("--");
    if (report.findings.empty() && !of_message) return tl::unexpected(error);
    report.findings.push_back(
        {"end",
         {of_message ? error.place.key : "drive", CommissionVerdict::Fail, to_string(error),
          of_message ? "the unit of this key in the robot's messages" : "the robot's program"}});
  }
  report.passed = done && *done && nothing_failed(report);
  if (Status written = write_result(report, setup, job); !written) return tl::unexpected(written.error());
  return report;
}

std::string to_text(const CommissionReport& report) {
  std::string text;
  for (const auto& [step, line] : report.findings) {
    text += fmt::format("{:<5} {:<7} {:<29} {}\n", to_string(line.verdict), step, line.key, line.words);
    if (!line.mend.empty()) text += fmt::format("{:<44}mend: {}\n", "", line.mend);
  }
  text += report.passed        ? "passed"
          : report.interrupted ? "stopped: the robot stands, nothing was written"
                               : "did not pass";
  if (!report.file.empty()) text += ", written into " + report.file;
  if (!report.kept.empty()) text += " (as it was before: " + report.kept + ")";
  if (report.file.empty() && !report.interrupted)
    text += "; the robot is simulated, nothing was written (-o FILE does)";
  return text + "\n";
}

nlohmann::ordered_json to_json(const CommissionReport& report) {
  auto findings = nlohmann::ordered_json::array();
  for (const auto& [step, line] : report.findings)
    findings.push_back({{"step", step},
                        {"check", line.key},
                        {"level", to_string(line.verdict)},
                        {"words", line.words},
                        {"mend", line.mend}});
  nlohmann::ordered_json figures = nlohmann::ordered_json::object();
  const CommissionFigures& f = report.figures;
  const auto add = [&](const char* key, const std::optional<double>& value) {
    if (value) figures[key] = *value;
  };
  add("response_s", f.response_s);
  add("stopping_s", f.stopping_s);
  add("stopping_m", f.stopping_m);
  add("silence_stopping_s", f.silence_stopping_s);
  add("kill_stopping_s", f.kill_stopping_s);
  add("speed_scale", f.speed_scale);
  add("yaw_rate_scale", f.yaw_rate_scale);
  return {{"passed", report.passed},   {"interrupted", report.interrupted},
          {"simulated", !report.real}, {"file", report.file},
          {"kept", report.kept},       {"figures", figures},
          {"findings", findings}};
}

}  // namespace waymark
