#include <cstdint>
#include <memory>
#include <string>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/live/write_samples.hpp"

namespace waymark::cli {
namespace {

struct SamplesArgs {
  SamplesJob job{};
  bool json = false;
};

ExitCode samples(const SamplesArgs& args, Console& console) {
  const Result<SamplesReport> report = write_samples(args.job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(to_json(*report, args.job)) : to_text(*report, args.job));
  return ExitCode::Ok;
}

Run prepare_samples(CLI::App& app) {
  const auto args = std::make_shared<SamplesArgs>();
  app.add_option("FOLDER", args->job.folder, "Folder to make; one that is not empty is refused")
      ->required()
      ->type_name("");
  app.add_option("--seed", args->job.seed, "Seed of all noise: the same seed gives the same samples")
      ->capture_default_str()
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53, "INTEGER"))
      ->type_name("INTEGER");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return samples(*args, console); };
}

}  // namespace

Verb samples_verb() {
  return {
      .name = "samples",
      .sentence = "Write a folder of simulated samples to learn with: laps, a map, pictures, a board",
      .help =
          R"(Everything is simulated, and its truth stands beside it: a taught lap and its map, the same lap by a robot
whose wheels, motors, gyro and camera are not what its file says, photographs of tags, and photographs of
a calibration board. README.txt in the folder names the verb that reads each. The labs read them too.

Exit code: 0 written, 1 something could not be written (nothing is left), 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark samples samples
  waymark samples samples-2 --seed 2 --json
)",
      .prepare = prepare_samples,
      .verbs = {}};
}

}  // namespace waymark::cli
