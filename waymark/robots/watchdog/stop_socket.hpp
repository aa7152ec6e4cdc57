#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

/// `waymark stop`: a Unix socket for each drive of a user, which whoever may be that user connects to. It
/// needs neither the page nor the terminal that the drive was started from.
namespace waymark {

/// $XDG_RUNTIME_DIR/waymark, or /tmp/waymark-UID: made when it is not there, readable by this user alone.
/// Fails when somebody else has it.
[[nodiscard]] Result<std::filesystem::path> stop_folder();

/// Listens, in a thread of its own, for as long as the drive lasts.
class StopSocket {
 public:
  /// `on_stop` is called by that thread at each request, before it is answered; it must not wait. `name`: of
  /// the drive, one line for people.
  static Result<std::unique_ptr<StopSocket>> open(const std::filesystem::path& folder, std::string name,
                                                  std::function<void()> on_stop);
  ~StopSocket();
  StopSocket(const StopSocket&) = delete;
  StopSocket& operator=(const StopSocket&) = delete;

 private:
  StopSocket() = default;
  void listen();

  std::filesystem::path path_;
  std::string answer_;
  std::function<void()> on_stop_;
  Descriptor socket_;
  Descriptor end_;  ///< closed by the other side: listening is over
  Descriptor over_;
  std::thread thread_;
};

/// What became of one drive.
struct StopAnswer {
  std::string drive;      ///< by its own words, or the name of its socket
  bool answered = false;  ///< it stops
};

/// Asks every drive that has a socket in the folder; waits for their answers up to `patience` in all. Sockets
/// that nobody listens on any more are removed.
[[nodiscard]] std::vector<StopAnswer> stop_all(const std::filesystem::path& folder, Duration patience);

}  // namespace waymark
