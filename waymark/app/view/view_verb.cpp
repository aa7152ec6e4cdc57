#include "waymark/app/cli/parts.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/view/offered_files.hpp"

namespace waymark::cli {
namespace {

struct ViewArgs {
  explicit ViewArgs(CLI::App& app) {
    add_option(app, "PATH", path,
               "Recording (MCAP), map.yaml, folder of a map, or folder with recordings. Default: drop a file "
               "on the page");
    add_fields(app, page);
  }

  std::string path;
  PageOptions page{};
};

ExitCode view(const ViewArgs& args, Console& console) {
  const JobControl control = control_from(console);
  auto offered = offered_by(args.path, control);
  if (!offered) return fail_with(offered.error(), console);
  Result<ServerOptions> options = server_options(args.page, false);
  if (!options) return fail_usage(options.error(), console);
  note_damage(*offered, control);
  options->offered = std::move(*offered);
  Result<HttpServer> server = HttpServer::listen(std::move(*options));
  if (!server) return fail_with(server.error(), console);
  announce(*server, args.page, control, [&](const std::string& url) { console.print(url + "\n"); });
  console.note("open this address in a browser; Ctrl-C ends");
  server->run([] { return interrupted(); });
  return ExitCode::Ok;
}

}  // namespace

Verb view_verb() {
  return {
      .name = "view",
      .sentence = "Show a recording or a map in the browser",
      .help =
          R"(Serves one page on this machine only. It shows tags, route and trajectories in 3-D or from above, camera images with
the detected tags, plots, and a timeline to scrub, play and step. The browser reads the recording by its index, so a
long recording opens as quickly as a short one. Nothing leaves the machine, and only the given files are served. The
address is printed to standard output. --listen allows access from other machines, which need the token in the
address. `waymark run --view`, `teach --view`, `replay --view` and `demo --view` show a running robot.

Exit code: 0 ended by Ctrl-C, 1 not readable or no port, 2 wrong usage.

Examples:
  waymark view demo
  waymark view lap.mcap --port 0 --open
)",
      .prepare = prepared(view)};
}

}  // namespace waymark::cli
