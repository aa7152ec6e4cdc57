#include "waymark/cli/stop_request.hpp"

#include "waymark/cli/interrupt.hpp"

namespace waymark::cli {

std::unique_ptr<StopSocket> hear_stop(const std::string& drive, Console& console) {
  const auto folder = stop_folder();
  auto socket = folder ? StopSocket::open(*folder, drive, interrupt)
                       : Result<std::unique_ptr<StopSocket>>(tl::unexpected(folder.error()));
  if (socket) return std::move(*socket);
  console.say("warning: " + to_string(socket.error()));
  return nullptr;
}

}  // namespace waymark::cli
