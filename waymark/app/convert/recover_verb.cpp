#include "waymark/app/cli/parts.hpp"
#include "waymark/app/convert/recover_log.hpp"

namespace waymark::cli {
namespace {

struct RecoverArgs : JobArgs<RecoverJob> {
  explicit RecoverArgs(CLI::App& app) : JobArgs(app) {
    app.get_option("--output")->transform(recording_name());
  }
};

ExitCode recover(const RecoverArgs& args, Console& console) {
  const Result<RecoverReport> report = recover_log(args.job);
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report));
  std::vector<std::string> problems;
  for (const Error& problem : report->recovery.problems) problems.push_back(to_string(problem));
  console.say_first(problems, "--json gives all");
  return ExitCode::Ok;
}

}  // namespace

Verb recover_verb() {
  return {
      .name = "recover",
      .sentence = "Restore the index of a recording that was cut off",
      .help =
          R"(Copies every whole record, by any writer of MCAP, and writes the indexes and the summary that a finished
recording ends with. Chunks and attachments whose checksum is wrong, records whose length or type is
damaged, and what is left of the last record, are left out and said. FILE is only read; the new file appears
whole or not at all. All verbs read a recording that was cut as far as it goes; a recovered one opens
quickly, and in every tool.

Exit code: 0 written, 1 not a recording, or not writable, 2 wrong usage.

Examples:
  waymark recover lap.mcap
  waymark recover lap.mcap -o whole.mcap --json
)",
      .prepare = prepared(recover),
      .report = report_of<RecoverReport>};
}

}  // namespace waymark::cli
