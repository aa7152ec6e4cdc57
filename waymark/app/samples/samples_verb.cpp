#include <cstdint>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/samples/write_samples.hpp"

namespace waymark::cli {
namespace {

struct SamplesArgs {
  explicit SamplesArgs(CLI::App& app) {
    add_fields(app, job);
    app.get_option("--seed")->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53, "INTEGER"));
    app.add_flag("--json", json, "Print one JSON object instead of text");
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
      .sentence = "Write a folder of simulated samples for learning: laps, a map, images, a board",
      .help =
          R"(All data are simulated and come with ground truth. They are a taught lap and its map, images of tags, and images of a
calibration board. The same lap is also driven by a robot whose wheels, motors, gyro and camera differ from its file.
README.txt in the folder lists the command for each. The labs use them too.
Exit code: 0 written, 1 a file could not be written (the folder is not created), 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark samples samples
  waymark samples samples-2 --seed 2 --json
)",
      .prepare = prepared(samples),
      .report = report_of<SamplesReport>};
}

}  // namespace waymark::cli
