#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>

#include "waymark/cli/report_run.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/jobs/staged_folder.hpp"

namespace waymark::cli {
namespace {

struct ReportArgs {
  std::vector<std::string> runs;
  std::string output = "report.html";
  bool force = false;
};

/// A report may be written anew; over a page of somebody else's it is not.
Status check_output(const ReportArgs& args) {
  std::error_code ignored;
  if (!args.force && std::filesystem::is_regular_file(args.output, ignored)) {
    std::string head(4096, '\0');
    std::ifstream(args.output, std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size()));
    if (head.find(plot::kPageMark) == std::string::npos)
      return fail(ErrorCode::Unwritable, "there is a page already that no `waymark report` wrote",
                  {.source = args.output}, "Give another name with -o, or --force to replace it.");
  }
  return check_output_file(args.output);
}

ExitCode report(const ReportArgs& args, Console& console) {
  const std::string suffix = std::filesystem::path(args.output).extension().string();
  if (suffix != ".html" && suffix != ".htm") {
    console.say(Error{ErrorCode::InvalidArgument,
                      "a report is a page: its name ends with .html",
                      {.source = args.output, .key = "--output"}});
    return ExitCode::Usage;
  }
  if (const Status free = check_output(args); !free) {
    console.say(free.error());
    return ExitCode::SomeFailed;
  }
  const Result<Runs> runs = read_runs(args.runs, console);
  if (!runs) {
    console.say(runs.error());
    return ExitCode::SomeFailed;
  }
  for (const std::string& warning : runs->warnings) console.say("warning: " + warning);
  const Result<plot::Page> page = report_page(*runs, console);
  const Result<std::string> html = page ? plot::to_html(*page) : tl::unexpected(page.error());
  const Status written = html ? write_text_file(args.output, *html) : tl::unexpected(html.error());
  if (!written) {
    console.say(written.error());
    return ExitCode::SomeFailed;
  }
  console.print(fmt::format("{}: {} sections, {:.1f} MB, opens in any browser\n", args.output,
                            page->sections.size(), static_cast<double>(html->size()) / 1e6));
  return ExitCode::Ok;
}

Run prepare_report(CLI::App& app) {
  const auto args = std::make_shared<ReportArgs>();
  app.add_option("RUN", args->runs,
                 "Recordings, folders of maps, or the folder of a demo; the first drive is what the others "
                 "are compared with")
      ->required()
      ->type_name("...");
  app.add_option("-o,--output", args->output, "HTML file to write")->capture_default_str()->type_name("FILE");
  app.add_flag("--force", args->force, "Replace a page that no report wrote");
  return [args](Console& console) { return report(*args, console); };
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
      .prepare = prepare_report,
      .verbs = {}};
}

}  // namespace waymark::cli
