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
      .sentence = "Write one page about drives and maps, with tables and figures",
      .help =
          R"(One HTML file that holds everything itself: it needs no network and no script, and prints well. For each
drive: how it was made, its way seen from above (truth green, odometry blue, estimate red), speed, tags in
view, error and doubt of the estimate. For each map: its tags with doubt and residuals, the map before and
after optimisation where the recording it was made of is given too. Several drives stand side by side, by what
needs no truth (a simulated one beside a real one, for example), and are compared with the way of the first: by
the truth, or by their estimate where there is none.

A report is written over an older one; over another file only with --force.

Exit code: 0 written, 1 something could not be read or written or there was nothing to show, 2 wrong usage.

Examples:
  waymark report demo -o report.html
  waymark report lap.mcap map replay.mcap
)",
      .prepare = prepared_job(report)};
}

}  // namespace waymark::cli
