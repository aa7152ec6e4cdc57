#include "waymark/app/cli/parts.hpp"
#include "waymark/app/convert/recording_info.hpp"

namespace waymark::cli {
namespace {

struct InfoArgs : JobArgs<InfoJob> {
  explicit InfoArgs(CLI::App& app) : JobArgs(app, "One JSON object instead of tables") {}
};

std::string words_of(const LogProblem& problem) {
  return (problem.kind == LogProblem::Kind::Trap ? "mind: " : "") + to_string(problem);
}

ExitCode info(const InfoArgs& args, Console& console) {
  const Result<RecordingInfo> found = look_at(args.job.file, args.job.quick, control_from(console));
  if (!found) return fail_with(found.error(), console);
  console.print(args.json ? json_line(fields(*found)) : to_text(*found));
  if (!found->summary.complete)
    console.say(
        "the file has no usable summary: it was cut, damaged or is still being written. What stands in "
        "it was counted.");
  std::vector<std::string> problems;
  for (const LogProblem& problem : found->problems) problems.push_back(words_of(problem));
  console.say_first(problems, "--json gives all");
  if (!interrupted()) return ExitCode::Ok;
  console.say("stopped: only what was read is counted");
  return ExitCode::Interrupted;
}

}  // namespace

Verb info_verb() {
  return {
      .name = "info",
      .sentence = "Summarise a recording: contents, defects and the verbs that can use it",
      .help =
          R"(Who wrote it, when, how long; its topics with type, number of messages and rate; messages that are missing,
stamps that are zero, twice or out of order, clocks that jumped; metadata; attachments; what misleads in
files of its kind; and which verbs take it next. The format is told by the content, whatever the name.
A file that was cut, or is still being written, has no summary: it is read front to back, and that is said.

Exit code: 0 read, 1 not a recording or not readable, 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark info lap.mcap
  waymark info --json lap.mcap
)",
      .prepare = prepared(info),
      .report = report_of<RecordingInfo>};
}

}  // namespace waymark::cli
