#include <fmt/format.h>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/evaluate/report_page.hpp"

namespace waymark::cli {
namespace {

ExitCode report(const ReportJob& args, Console& console) {
  const auto summary = write_report(args.runs, args.output, args.force, control_from(console));
  if (!summary) return fail_with(summary.error(), console);
  console.print(fmt::format("{}: {} sections, {:.1f} MB, opens in any browser\n", args.output,
                            summary->sections, static_cast<double>(summary->bytes) / 1e6));
  return ExitCode::Ok;
}

}  // namespace

Verb report_verb() {
  return {
      .name = "report",
      .sentence = "Write a page about drives and maps, with tables and figures",
      .help =
          R"(Writes one self-contained HTML file that can be viewed or printed without scripts or network access.

For each drive, it shows how the recording was made, and the trajectory seen from above (ground truth green, odometry
blue, estimate red). It also shows speed, tags in view, and error and standard deviation of the estimate. For each map,
it shows the tags with standard deviations and residuals; if the map's recording is given, also the map before and after
optimisation. Several drives, for example a simulated and a real one, are compared in a table that needs no ground
truth. The trajectory of each drive (ground truth, or the estimate if there is none) is compared with that of the first
drive.

A report replaces an older report; any other file is replaced only with --force.

Exit code: 0 written, 1 a file could not be read or written or there was nothing to show, 2 wrong usage.

Examples:
  waymark report demo -o report.html
  waymark report lap.mcap map replay.mcap
)",
      .prepare = prepared_job(report)};
}

}  // namespace waymark::cli
