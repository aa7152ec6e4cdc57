#include "waymark/cli/live_view.hpp"

#include <array>
#include <chrono>
#include <utility>

#include <fmt/format.h>
#include <spawn.h>
#include <CLI/App.hpp>

#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/settings.hpp"
#include "waymark/server/access.hpp"
#include "waymark/server/assets.hpp"

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX has it in no header

namespace waymark::cli {

void add_flags(CLI::App& app, PageFlags& flags, CLI::Option* view) {
  std::array<CLI::Option*, 4> all{};
  all[0] = app.add_option("--port", flags.port, "Port of the page; where it is taken, any other. 0: any")
               ->check(CLI::Range(0, 65535))
               ->capture_default_str();
  all[1] =
      app.add_option(
             "--listen", flags.listen,
             "Address of this machine at which others reach the page, 0.0.0.0 for all; they need the token")
          ->capture_default_str()
          ->type_name("ADDRESS");
  all[2] = app.add_option("--token", flags.token,
                          "Token that grants control and remote viewing: 16 characters or more. Unless "
                          "given: a random one")
               ->type_name("WORD");
  all[3] = app.add_flag("--open", flags.open, "Open the page in the browser");
  if (view == nullptr) return;
  for (CLI::Option* option : all) option->needs(view);
  for (std::size_t i = 0; i < 3; ++i) all[i]->group(kMoreGroup);
}

void add_flags(CLI::App& app, LiveFlags& flags) {
  CLI::Option* view =
      app.add_flag("--view", flags.view, "Show the robot in the browser while it runs, with buttons");
  add_flags(app, flags.page, view);
}

Result<ServerOptions> server_options(const PageFlags& flags, bool live) {
  ServerOptions options{.port = static_cast<std::uint16_t>(flags.port), .address = flags.listen};
  if (!flags.token.empty()) {
    if (Status status = check_token(flags.token); !status) return tl::unexpected(status.error());
    options.token = flags.token;
  } else if (live || flags.listen != "127.0.0.1") {
    options.token = make_token();
  }
  return options;
}

bool open_browser(const std::string& url) {
#ifdef __APPLE__
  std::string program = "open";
#else
  std::string program = "xdg-open";
#endif
  std::string argument = url;
  std::array<char*, 3> words = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  return posix_spawnp(&child, program.c_str(), nullptr, nullptr, words.data(), environ) == 0;
}

void announce(const HttpServer& server, const PageFlags& flags, Console& console, bool to_output) {
  if (viewer_assets().empty())
    console.say(
        "the page is not in this program: run tools/build_viewer.sh in its source folder and build again");
  if (flags.port != 0 && server.port() != flags.port)
    console.say(fmt::format("port {} is taken: this is another one", flags.port));
  if (to_output)
    console.print(server.url() + "\n");
  else
    console.say("the page: " + server.url());
  for (const std::string& url : server.urls_from_elsewhere()) console.say("from another machine: " + url);
  if (flags.open && !open_browser(server.url())) console.say("no browser could be opened: do it by hand");
}

Result<std::unique_ptr<LiveView>> LiveView::start(const LiveFlags& flags, const RobotSetup& setup,
                                                  Console& console) {
  if (!flags.view) return std::unique_ptr<LiveView>();
  if (setup.process.empty())
    return fail(ErrorCode::InvalidArgument, "a simulated robot is watched with `waymark run --view`",
                {.key = "--view"},
                "This verb lets it go as fast as it can; with --robot process:CMD it waits.");
  Result<ServerOptions> options = server_options(flags.page, true);
  if (!options) return tl::unexpected(options.error());
  std::unique_ptr<LiveView> view(new LiveView);
  options->feed = &view->feed_;
  options->robot_name = setup.simulated.model.name;
  Result<HttpServer> server = HttpServer::listen(std::move(*options));
  if (!server) return tl::unexpected(server.error());
  announce(*server, flags.page, console, false);
  view->server_ = std::make_unique<HttpServer>(std::move(*server));
  view->thread_ =
      std::thread([live = view.get()] { live->server_->run([live] { return live->over_.load(); }); });
  return view;
}

LiveView::~LiveView() {
  over_ = true;
  if (thread_.joinable()) thread_.join();
}

std::int64_t host_now_ns() {
  return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()).count();
}

LiveWords words_on(Console& console) {
  return {.say = [&console](const std::string& words) { console.say(words); },
          .progress = [&console](const std::string& line) { console.live(line); },
          .should_stop = [] { return interrupted(); }};
}

RobotListener watched(RobotListener listener, LiveFeed* feed) {
  listener.should_stop = [] { return interrupted(); };
  if (feed == nullptr) return listener;
  RobotListener out = listener;
  out.on_sample = [feed, inner = std::move(listener.on_sample)](const Sample& sample) {
    feed->publish(sample, host_now_ns());
    return inner(sample);
  };
  return out;
}

}  // namespace waymark::cli
