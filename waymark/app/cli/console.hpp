#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark::cli {

/// What the program tells its caller.
enum class ExitCode : std::uint8_t {
  Ok = 0,            ///< all inputs processed, whatever was found in them
  SomeFailed = 1,    ///< some input or output failed; the others were processed
  Usage = 2,         ///< the command line makes no sense
  Interrupted = 130  ///< stopped by Ctrl-C; what was done is kept
};

/// Where words go: results to standard output, everything else to standard error, with a progress line below
/// it when standard error is a terminal.
class Console {
 public:
  /// `verb` introduces what is said ("waymark detect: …").
  explicit Console(std::string verb, std::FILE* out = stdout, std::FILE* err = stderr);

  /// Results; passed on at once, so that what was printed survives whatever comes later.
  void print(std::string_view text);
  /// One line of words: "waymark detect: words".
  void say(std::string_view words);
  void say(const Error& error) { say(to_string(error)); }
  /// Says it, and gives back the code: `return console.failed(error, ExitCode::Usage);`
  [[nodiscard]] ExitCode failed(const Error& error, ExitCode code) {
    say(error);
    return code;
  }
  /// "warning: ..." of each; many that are alike as folded_warnings() has them.
  void warn(const std::vector<std::string>& warnings);
  /// Says the first few lines of many; how many more there are, and where they stand.
  void say_first(const std::vector<std::string>& lines, std::string_view where_all);
  /// Redraws the progress line ("12/60 photo.png"), ten times a second at most; silent unless a terminal
  /// watches.
  void progress(std::size_t done, std::size_t all, std::string_view what);
  /// Redraws the line below everything with these words, as progress() does.
  void live(std::string_view line);
  void end_progress();

  /// Nobody can read the results any more: the reader closed the pipe, or writing failed. Stop working.
  [[nodiscard]] bool output_ended() const { return output_ != Output::Open; }
  /// `code`, unless results were lost: then SomeFailed, said in words. A reader who closed the pipe has seen
  /// enough: Ok. What failed after Ctrl-C was interrupted.
  [[nodiscard]] ExitCode finish(ExitCode code);

 private:
  /// Whether the line may be redrawn now.
  [[nodiscard]] bool time_to_redraw();

  enum class Output : std::uint8_t { Open, ClosedByReader, Failed };

  std::string verb_;
  std::FILE* out_;
  std::FILE* err_;
  bool watched_ = false;
  bool progress_shown_ = false;
  std::int64_t last_progress_ms_ = 0;
  Output output_ = Output::Open;
};

}  // namespace waymark::cli
