#include "waymark/app/convert/recover_log.hpp"

#include <filesystem>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"

namespace waymark {
namespace {

/// Returns "lap.recovered.mcap" for both "lap.mcap" and "lap".
std::string recovered_name(const std::string& file) {
  const std::filesystem::path path(file);
  const bool has_suffix = path.extension() == ".mcap" || path.extension() == ".MCAP";
  const std::string name = (has_suffix ? path.stem() : path.filename()).string();
  return (path.parent_path() / (name + ".recovered.mcap")).string();
}

}  // namespace

Result<RecoverReport> recover_log(const RecoverJob& job) {
  const std::string output = job.output.empty() ? recovered_name(job.file) : job.output;
  Result<mcap::Recovery> recovery =
      or_wrong_kind(mcap::recover_file(job.file, output), job.file, FileUse::Recording);
  if (!recovery) return tl::unexpected(recovery.error());
  return RecoverReport{job.file, output, std::move(*recovery)};
}

ReportFields fields(const RecoverReport& report) {
  const mcap::Recovery& recovery = report.recovery;
  std::vector<std::string> problems;
  for (const Error& problem : recovery.problems) problems.push_back(to_string(problem));
  return {{"file", "Recording that was read", report.file},
          {"output", "Recording that was written", report.output},
          {"was_whole", "Whether the original was complete and undamaged, including its summary",
           recovery.was_whole},
          {"messages", "Number of messages in the new recording", recovery.messages},
          {"chunks", "Number of chunks in the new recording", recovery.chunks},
          {"kept_bytes", "Size of the copied part of the data section", recovery.kept_bytes},
          {"lost_bytes", "Size of damaged records and of the data after the last intact record",
           recovery.lost_bytes},
          {"problems", "Error messages about the original recording", problems}};
}

std::string to_text(const RecoverReport& report) {
  const mcap::Recovery& recovery = report.recovery;
  if (recovery.was_whole)
    return fmt::format("{} was intact; {} contains the same {} messages\n", report.file, report.output,
                       recovery.messages);
  return fmt::format("{}: {} messages in {} chunks; {} bytes of {} are lost\n", report.output,
                     recovery.messages, recovery.chunks, recovery.lost_bytes, report.file);
}

}  // namespace waymark
