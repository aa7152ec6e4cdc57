#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/verb.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/recording/mcap_recover.hpp"

namespace waymark::cli {
namespace {

struct RecoverArgs {
  std::string file;
  std::string output;
  bool json = false;
};

/// lap.mcap becomes lap.recovered.mcap.
std::string beside(const std::string& file) {
  const std::filesystem::path path(file);
  return (path.parent_path() / (path.stem().string() + ".recovered" + path.extension().string())).string();
}

nlohmann::ordered_json to_json(const mcap::Recovery& recovery, const RecoverArgs& args,
                               const std::string& output) {
  std::vector<std::string> problems;
  for (const Error& problem : recovery.problems) problems.push_back(to_string(problem));
  return {{"file", args.file},
          {"output", output},
          {"was_whole", recovery.was_whole},
          {"messages", recovery.messages},
          {"chunks", recovery.chunks},
          {"kept_bytes", recovery.kept_bytes},
          {"lost_bytes", recovery.lost_bytes},
          {"problems", problems}};
}

std::string to_text(const mcap::Recovery& recovery, const RecoverArgs& args, const std::string& output) {
  if (recovery.was_whole)
    return fmt::format("{} was whole: {} is the same, {} messages\n", args.file, output, recovery.messages);
  return fmt::format("{}: {} messages in {} chunks; {} bytes at the end of {} are lost\n", output,
                     recovery.messages, recovery.chunks, recovery.lost_bytes, args.file);
}

ExitCode recover(const RecoverArgs& args, Console& console) {
  const std::string output = args.output.empty() ? beside(args.file) : args.output;
  const Result<mcap::Recovery> recovery = mcap::recover_file(args.file, output);
  if (!recovery) return console.failed(recovery.error(), ExitCode::SomeFailed);
  console.print(args.json ? json_line(to_json(*recovery, args, output)) : to_text(*recovery, args, output));
  for (const Error& problem : recovery->problems) console.say(problem);
  return ExitCode::Ok;
}

Run prepare(CLI::App& app) {
  const auto args = std::make_shared<RecoverArgs>();
  app.add_option("FILE", args->file, "Recording (.mcap) that was cut, damaged or never finished")
      ->required()
      ->type_name("");
  app.add_option("-o,--output", args->output,
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
