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
  console.note_first(problems, "--json gives all");
  return ExitCode::Ok;
}

}  // namespace

Verb recover_verb() {
  return {
      .name = "recover",
      .sentence = "Restore the index of a truncated recording",
      .help =
          R"(Copies every intact record of a file written by any MCAP writer, and adds the indexes and the summary of a complete
recording. Chunks and attachments with a wrong checksum, records with an invalid length or type, and an incomplete last
record are omitted and reported. FILE is not changed; the new file is written completely or not at all. All verbs can
read a truncated recording up to its end; a recovered recording opens quickly and is supported by all tools.

Exit code: 0 written, 1 FILE is not a recording, or a file could not be read or written, 2 wrong usage.

Examples:
  waymark recover lap.mcap
  waymark recover lap.mcap -o whole.mcap --json
)",
      .prepare = prepared(recover),
      .report = report_of<RecoverReport>};
}

}  // namespace waymark::cli
