#include <memory>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/verb.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/recover_log.hpp"

namespace waymark::cli {
namespace {

struct RecoverArgs {
  RecoverJob job{};
  bool json = false;
};

ExitCode recover(const RecoverArgs& args, Console& console) {
  const Result<RecoverReport> report = recover_log(args.job);
  if (!report) return console.failed(report.error(), ExitCode::SomeFailed);
  console.print(args.json ? json_line(to_json(*report)) : to_text(*report));
  std::vector<std::string> problems;
  for (const Error& problem : report->recovery.problems) problems.push_back(to_string(problem));
  console.say_first(problems, "--json gives all");
  return ExitCode::Ok;
}

Run prepare(CLI::App& app) {
  const auto args = std::make_shared<RecoverArgs>();
  app.add_option("FILE", args->job.file, "Recording (.mcap) that was cut, damaged or never finished")
      ->required()
      ->type_name("");
  app.add_option("-o,--output", args->job.output,
                 "The file to write; must not exist. Unless given: lap.recovered.mcap beside lap.mcap")
      ->type_name("FILE");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return recover(*args, console); };
}

}  // namespace

Verb recover_verb() {
  return {
      .name = "recover",
      .sentence = "Restore the index of a recording that was cut off",
      .help =
          R"(Copies every whole record as it is, by any writer of MCAP, and writes the indexes and the summary that a
finished recording ends with. Chunks whose checksum is wrong, and what is left of the last record, are left
out and said. FILE is only read; the new file appears whole or not at all. Reading needs none of this: all
verbs read a recording that was cut as far as it goes; a recovered one opens quickly, and in every tool.

Exit code: 0 written, 1 not a recording, or not writable, 2 wrong usage.

Examples:
  waymark recover lap.mcap
  waymark recover lap.mcap -o whole.mcap --json
)",
      .prepare = prepare,
      .verbs = {}};
}

}  // namespace waymark::cli
