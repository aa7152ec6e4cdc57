#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "waymark/cli/console.hpp"
#include "waymark/cli/setup_flags.hpp"
#include "waymark/live/live_robot.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/server/http_server.hpp"
#include "waymark/server/live_feed.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace waymark::cli {

/// The flags of every verb that serves the page.
struct PageFlags {
  int port = 8642;
  std::string listen = "127.0.0.1";
  std::string token = {};
  bool open = false;
};
/// With `view`, they mean something only where it is given.
void add_flags(CLI::App& app, PageFlags& flags, CLI::Option* view = nullptr);

/// --view, and the flags of the page with it.
struct LiveFlags {
  bool view = false;
  PageFlags page{};
};
void add_flags(CLI::App& app, LiveFlags& flags);

/// Options of the server by the flags; a server that others reach, or that shows a robot, gets a token where
/// none is given. Fails on a token that is too weak.
[[nodiscard]] Result<ServerOptions> server_options(const PageFlags& flags, bool live);

/// Prints the address of the page, says what is worth saying, and opens it if asked to.
void announce(const HttpServer& server, const PageFlags& flags, Console& console, bool to_output);

/// Asks the desktop to show the page; that there is none is no failure of ours.
[[nodiscard]] bool open_browser(const std::string& url);

/// The page of a robot that runs, served by a thread of its own until this is destroyed. The robot's loop
/// must have ended by then.
class LiveView {
 public:
  /// nullptr without --view. Fails when the robot of the setup is no process: a simulated one in this process
  /// goes as fast as it can, which nobody could watch.
  static Result<std::unique_ptr<LiveView>> start(const LiveFlags& flags, const RobotSetup& setup,
                                                 Console& console);
  ~LiveView();
  LiveView(const LiveView&) = delete;
  LiveView& operator=(const LiveView&) = delete;

  [[nodiscard]] LiveFeed& feed() { return feed_; }

 private:
  LiveView() = default;
  LiveFeed feed_{};
  std::unique_ptr<HttpServer> server_{};
  std::atomic<bool> over_{false};
  std::thread thread_{};
};

/// The system's clock, as the feed wants it.
[[nodiscard]] std::int64_t host_now_ns();

/// A listener whose samples viewers see as well, if there is a feed, and that Ctrl-C ends.
[[nodiscard]] RobotListener watched(RobotListener listener, LiveFeed* feed);

/// What a drive says, on this console.
[[nodiscard]] LiveWords words_on(Console& console);

}  // namespace waymark::cli
