#include "waymark/app/cli/parts.hpp"
#include "waymark/app/convert/recording_info.hpp"

namespace waymark::cli {
namespace {

struct InfoArgs : JobArgs<InfoJob> {
  explicit InfoArgs(CLI::App& app) : JobArgs(app, "One JSON object instead of tables") {}
};

std::string problem_line(const LogProblem& problem) {
  return (problem.kind == LogProblem::Kind::Trap ? "note: " : "") + to_string(problem);
}

ExitCode info(const InfoArgs& args, Console& console) {
  const Result<RecordingInfo> found = look_at(args.job.file, args.job.quick, control_from(console));
  if (!found) return fail_with(found.error(), console);
  console.print(args.json ? json_line(fields(*found)) : to_text(*found));
  if (!found->summary.complete)
    console.note(
        "the file has no usable summary: it is truncated, damaged or still being written. Its messages were "
        "counted.");
  std::vector<std::string> problems;
  for (const LogProblem& problem : found->problems) problems.push_back(problem_line(problem));
  console.note_first(problems, "--json gives all");
  if (!interrupted()) return ExitCode::Ok;
  console.note("stopped: the counts cover only the part that was read");
  return ExitCode::Interrupted;
}

}  // namespace

Verb info_verb() {
  return {
      .name = "info",
      .sentence = "Summarise a recording: contents, defects, and the verbs that can use it",
      .help =
          R"(Prints writer, time, duration, metadata and attachments, and for each topic its type, number of messages and rate. It
reports missing messages, zero, duplicate and unordered stamps, clock jumps, and known traps of such files. Finally, it
lists the verbs that can use the recording. The format is detected from the content, not the name.
A file that is truncated or still being written has no summary. It is read completely, with a warning.

Exit code: 0 read, 1 the file is not a recording or could not be read, 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark info lap.mcap
  waymark info --json lap.mcap
)",
      .prepare = prepared(info),
      .report = report_of<RecordingInfo>};
}

}  // namespace waymark::cli
