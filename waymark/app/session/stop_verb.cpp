#include <algorithm>

#include "waymark/app/cli/parts.hpp"
#include "waymark/robots/watchdog/stop_socket.hpp"

namespace waymark::cli {
namespace {

constexpr Duration kPatience = std::chrono::seconds(2);

ExitCode stop(Console& console) {
  const auto folder = stop_folder();
  if (!folder) return console.failed(folder.error(), ExitCode::SomeFailed);
  const std::vector<StopAnswer> answers = stop_all(*folder, kPatience);
  for (const StopAnswer& one : answers) {
    if (one.answered)
      console.print("stops: " + one.drive + "\n");
    else
      console.note("no answer from " + one.drive + "; if it does not respond, its watchdog stops the robot");
  }
  if (answers.empty()) console.note("this user has no running drive");
  return !answers.empty() && std::ranges::all_of(answers, &StopAnswer::answered) ? ExitCode::Ok
                                                                                 : ExitCode::SomeFailed;
}

}  // namespace

Verb stop_verb() {
  return {
      .name = "stop",
      .sentence = "Stop every robot that this user drives on this machine",
      .help =
          R"(Ends each `run`, `teach --robot process:...`, `replay --robot process:...` and `demo --view` of this user like
Ctrl-C in its terminal: the robot is commanded to stop, and the recording is kept. Each drive listens on a Unix
socket in $XDG_RUNTIME_DIR/waymark, or /tmp/waymark-UID, without the page or the network.
Exit code: 0 every drive answered, 1 no drive is running or one did not answer within 2 s.

Example:
  waymark stop
  stops: replay of map (process 4711)
)",
      .prepare = prepared(stop)};
}

}  // namespace waymark::cli
