#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/app/cli/field_flags.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/base/error.hpp"
#include "waymark/robots/watchdog/stop_socket.hpp"

/// How the program talks with who runs it: words and results, exit codes, Ctrl-C.
namespace waymark::cli {

/// From now on the first Ctrl-C (or SIGTERM) only raises a flag, so that the picture at hand is finished and
/// what was done is kept; the second of the same kind says so and ends the
/// program at once. Writing to a closed pipe, or more than a
/// file may hold, becomes an error instead of a signal.
void watch_signals();

/// The same as Ctrl-C, from any thread: another process asked for it with `waymark stop`.
void interrupt();

/// Whether Ctrl-C was pressed, or a stop was requested, since watch_signals().
[[nodiscard]] bool interrupted();
/// Which of the two, in words: "Ctrl-C" or "'waymark stop'".
[[nodiscard]] const char* interrupted_by();

/// The first warnings of each kind and how many more there are, for people; alike are those that differ in
/// numbers only (ids of tags are numbers). In the order of the first of each kind.
[[nodiscard]] std::vector<std::string> folded_warnings(const std::vector<std::string>& warnings);

/// The error of a field as people type it: "(--tag-size-m): ...". Keys in a file, and what the program has no
/// flag for, stay as they are.
[[nodiscard]] Error naming_flag(Error error, const HasFlag& has_flag);

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
  /// `verb` introduces what is said ("waymark detect: …"). Fields that texts name are written as flags of the
  /// program (with_flags()), the field of an error as a flag of the verb (`has_own`; an input keeps its
  /// name); without `has_flag` they stay.
  explicit Console(std::string verb, std::FILE* out = stdout, std::FILE* err = stderr, HasFlag has_flag = {},
                   HasFlag has_own = {});

  /// Results; passed on at once, so that what was printed survives whatever comes later.
  void print(std::string_view text);
  /// The same with all words as they are: help.
  void print_help(std::string_view text);
  /// One line of words: "waymark detect: words".
  void say(std::string_view words);
  /// The same of an error, whose field is named as the flag that sets it (naming_flag()).
  void say(const Error& error) { say(to_string(naming_flag(error, has_own_))); }
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

  /// The text with the flags of the program for fields.
  [[nodiscard]] std::string text_for_users(std::string_view text) const;

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
  HasFlag has_flag_;
  HasFlag has_own_;
  std::FILE* out_;
  std::FILE* err_;
  bool watched_ = false;
  bool progress_shown_ = false;
  std::int64_t last_progress_ms_ = 0;
  Output output_ = Output::Open;
};

// How a verb fails: which words, and which exit code.

/// 2 for what the command line or the environment says (the error's key is a field: there is no source, or
/// it is between backticks; or the source is "environment"), 1 for a file that is not usable or could not be
/// written. Console::finish() makes 130 of both after Ctrl-C.
[[nodiscard]] ExitCode exit_code_of(const Error& error);

/// Says the error, and gives back its exit code.
[[nodiscard]] ExitCode fail_with(const Error& error, Console& console);

/// Says the error: of what makes no sense (InvalidArgument) 2, else as fail_with().
[[nodiscard]] ExitCode fail_by_kind(const Error& error, Console& console);

/// Prints the error: 2 as the command line makes no sense, 1 where the error is of a file or a device
/// (exit_code_of()).
[[nodiscard]] ExitCode fail_usage(const Error& error, Console& console);

/// A job's progress and notes go to the console, and Ctrl-C cancels it.
[[nodiscard]] JobControl control_from(Console& console);

/// While it lives `waymark stop` ends this drive as Ctrl-C does. nullptr, and words, where that is not
/// possible: the drive goes on without.
[[nodiscard]] std::unique_ptr<StopSocket> listen_for_stop(const std::string& drive, Console& console);

}  // namespace waymark::cli
