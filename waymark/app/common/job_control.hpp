#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Measures the duration of a job with the steady clock.
class Stopwatch {
 public:
  Stopwatch();
  [[nodiscard]] double seconds() const;

 private:
  std::int64_t start_ns_;
};

/// Peak memory of this process [MiB].
[[nodiscard]] double peak_rss_mib();

/// Progress of a job, as text ("finding tags: 12.3 s") and, if known, as a count.
struct JobProgress {
  std::string text{};
  std::size_t done = 0;
  std::size_t all = 0;  ///< total count; 0 if unknown
};

/// Callbacks of a running job. All are called on the caller's thread, while the job waits.
struct JobControl {
  /// Called often with the current progress, which replaces the previous one.
  std::function<void(const JobProgress&)> progress = [](const JobProgress&) {};
  /// Called rarely, with a sentence about the input that is not repeated in the summary.
  std::function<void(const std::string&)> note = [](const std::string&) {};
  /// Converts a text that is displayed elsewhere than in the notes, for example on a page. The program
  /// replaces fields with its flags.
  std::function<std::string(std::string_view)> for_users = [](std::string_view text) {
    return std::string(text);
  };
  /// Returns true once the job should stop. The job then fails and leaves its output files unchanged.
  std::function<bool()> cancelled = [] { return false; };

  /// Returns an error once the job should stop. Use it between steps that cannot be interrupted.
  [[nodiscard]] Status go_on() const {
    return cancelled() ? Status(fail(ErrorCode::Unreadable, "stopped: nothing was written")) : Status();
  }

  /// The options with which a job opens a recording; cancelling the job then also stops decompression.
  [[nodiscard]] LogOptions log_options(LogOptions options = {}) const {
    options.unpack.stop = cancelled;
    return options;
  }
};

/// The same control without progress text, for a step that reports its own progress.
[[nodiscard]] inline JobControl silent(const JobControl& control) {
  JobControl quiet;
  quiet.for_users = control.for_users;
  quiet.cancelled = control.cancelled;
  return quiet;
}

}  // namespace waymark
