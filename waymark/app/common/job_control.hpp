#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Measures the duration of a job by the steady clock.
class Stopwatch {
 public:
  Stopwatch();
  [[nodiscard]] double seconds() const;

 private:
  std::int64_t start_ns_;
};

/// Peak memory of this process [MiB].
[[nodiscard]] double peak_rss_mib();

/// Progress of a job as text ("finding tags: 12.3 s"), and as a count if known.
struct JobProgress {
  std::string text{};
  std::size_t done = 0;
  std::size_t all = 0;  ///< 0: unknown
};

/// Callbacks of a running job. All are called on the caller's thread, while the job waits.
struct JobControl {
  /// Called often; each text replaces the previous one.
  std::function<void(const JobProgress&)> progress = [](const JobProgress&) {};
  /// Called rarely: a sentence about the input that the summary does not repeat.
  std::function<void(const std::string&)> note = [](const std::string&) {};
  /// Converts a text for display outside the notes, such as on a page. The program replaces fields by its
  /// flags.
  std::function<std::string(std::string_view)> for_users = [](std::string_view text) {
    return std::string(text);
  };
  /// True once the job should end. It then fails and leaves its output files unchanged.
  std::function<bool()> cancelled = [] { return false; };

  /// An error once the job should end, for steps that cannot be interrupted.
  [[nodiscard]] Status go_on() const {
    return cancelled() ? Status(fail(ErrorCode::Unreadable, "stopped: nothing was written")) : Status();
  }

  /// The options with which a job opens a recording, so that cancelling also stops decompression.
  [[nodiscard]] LogOptions log_options(LogOptions options = {}) const {
    options.unpack.stop = cancelled;
    return options;
  }
};

/// The same without progress text, for a step that reports its own progress.
[[nodiscard]] inline JobControl silent(const JobControl& control) {
  JobControl quiet;
  quiet.for_users = control.for_users;
  quiet.cancelled = control.cancelled;
  return quiet;
}

}  // namespace waymark
