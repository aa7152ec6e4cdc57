#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {

/// How long a job took, by the steady clock.
class Stopwatch {
 public:
  Stopwatch();
  [[nodiscard]] double seconds() const;

 private:
  std::int64_t start_ns_;
};

/// The most memory this process ever held [MiB].
[[nodiscard]] double peak_rss_mib();

/// How far a job is, in words ("finding tags: 12.3 s"), and by counting where that is known.
struct JobProgress {
  std::string words{};
  std::size_t done = 0;
  std::size_t all = 0;  ///< 0: unknown
};

/// How a job and its caller talk while it runs. All are called on the caller's thread, while the job waits.
struct JobControl {
  /// Often; each replaces the one before.
  std::function<void(const JobProgress&)> progress = [](const JobProgress&) {};
  /// Rarely: a sentence about the input that the summary does not repeat.
  std::function<void(const std::string&)> note = [](const std::string&) {};
  /// A text as it is shown to users beside the notes, on a page, say: the program writes its flags for
  /// fields.
  std::function<std::string(std::string_view)> for_users = [](std::string_view text) {
    return std::string(text);
  };
  /// True once the job is to end. It then fails and leaves what it would have written as it was before.
  std::function<bool()> cancelled = [] { return false; };

  /// An error once the job is to end, for the steps of a job that cannot be half done.
  [[nodiscard]] Status go_on() const {
    return cancelled() ? Status(fail(ErrorCode::Unreadable, "stopped: nothing was written")) : Status();
  }

  /// The options with which a job opens a recording: cancelling ends also the unpacking of a packed one.
  [[nodiscard]] LogOptions log_options(LogOptions options = {}) const {
    options.unpack.stop = cancelled;
    return options;
  }
};

/// The same without words: for a step of a job that shows its own.
[[nodiscard]] inline JobControl silent(const JobControl& control) {
  JobControl quiet;
  quiet.for_users = control.for_users;
  quiet.cancelled = control.cancelled;
  return quiet;
}

}  // namespace waymark
