#include <cstdint>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/samples/write_samples.hpp"

namespace waymark::cli {
namespace {

struct SamplesArgs {
  explicit SamplesArgs(CLI::App& app) {
    add_fields(app, job);
    app.get_option("--seed")->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53, "INTEGER"));
    app.add_flag("--json", json, "One JSON object instead of words");
  }

  SamplesJob job{};
  bool json = false;
};

ExitCode samples(const SamplesArgs& args, Console& console) {
  const Result<SamplesReport> report = write_samples(args.job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report));
  return ExitCode::Ok;
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
      .prepare = prepared(samples),
      .report = report_of<SamplesReport>};
}

}  // namespace waymark::cli
