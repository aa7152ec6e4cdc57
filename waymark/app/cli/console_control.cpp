#include "waymark/app/cli/console_control.hpp"

#include "waymark/app/cli/interrupt.hpp"

namespace waymark::cli {

JobControl control_from(Console& console) {
  JobControl control;
  control.cancelled = interrupted;
  control.progress = [&console](const JobProgress& now) {
    if (now.all > 0)
      console.progress(now.done, now.all, now.words);
    else
      console.live(now.words);
  };
  control.note = [&console](const std::string& words) { console.say(words); };
  return control;
}

std::unique_ptr<StopSocket> listen_for_stop(const std::string& drive, Console& console) {
  const auto folder = stop_folder();
  auto socket = folder ? StopSocket::open(*folder, drive, interrupt)
                       : Result<std::unique_ptr<StopSocket>>(tl::unexpected(folder.error()));
  if (socket) return std::move(*socket);
  console.say("warning: " + to_string(socket.error()));
  return nullptr;
}

}  // namespace waymark::cli
