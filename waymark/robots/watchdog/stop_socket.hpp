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

/// `waymark stop`: a Unix socket for each drive, to which any process of the same user can connect. A drive
/// can thus be stopped without the page or the terminal in which it was started.
namespace waymark {

/// The folder $XDG_RUNTIME_DIR/waymark, or /tmp/waymark-UID. If missing, it is created so that only this user
/// can access it. Fails if it belongs to another user or is accessible to others.
[[nodiscard]] Result<std::filesystem::path> stop_folder();

/// Listens on its own thread during the drive.
class StopSocket {
 public:
  /// `on_stop` is called on that thread for each request, before it is answered, and must not block. `name`
  /// is a one-line description of the drive.
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
  Descriptor end_;  ///< read end of a pipe; listening ends when its write end, `over_`, is closed
  Descriptor over_;
  std::thread thread_;
};

/// The answer from one drive.
struct StopAnswer {
  std::string drive;      ///< its description, or the name of its socket if it did not answer
  bool answered = false;  ///< whether the drive is stopping
};

/// Requests a stop from every drive with a socket in the folder, and waits up to `patience` for all answers.
/// Sockets without a listening process are removed.
[[nodiscard]] std::vector<StopAnswer> stop_all(const std::filesystem::path& folder, Duration patience);

}  // namespace waymark
