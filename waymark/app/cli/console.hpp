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

/// Handles the terminal: results, messages, progress, exit codes, signals.
namespace waymark::cli {

/// Installs signal handlers. After the first Ctrl-C (or SIGTERM), the current image is finished and results
/// are kept. The second signal of the same kind prints a message and ends the program immediately. Writing to
/// a closed pipe, or beyond the limit on file size, becomes an error instead of a signal.
void watch_signals();

/// Has the same effect as Ctrl-C, but can be called from any thread. Used when another process runs `waymark
/// stop`.
void interrupt();

/// Whether Ctrl-C has been pressed, or a stop has been requested, since watch_signals() was called.
[[nodiscard]] bool interrupted();
/// What caused the interruption: "Ctrl-C", "SIGTERM", "the closed terminal" or "'waymark stop'".
[[nodiscard]] const char* interrupted_by();

/// The first warnings of each kind, and the number of further ones. Two warnings are of the same kind if they
/// differ only in their numbers (which include tag IDs). Kinds are in the order of their first warnings.
[[nodiscard]] std::vector<std::string> folded_warnings(const std::vector<std::string>& warnings);

/// The error, with its field shown as the flag that users type: "(--tag-size-m): ...". Keys in a file and
/// fields without a flag are unchanged.
[[nodiscard]] Error naming_flag(Error error, const HasFlag& has_flag);

/// The program's exit status.
enum class ExitCode : std::uint8_t {
  Ok = 0,            ///< all inputs processed, regardless of the results
  SomeFailed = 1,    ///< some input or output failed; all others were processed
  Usage = 2,         ///< invalid command line; nothing was done
  Interrupted = 130  ///< stopped by Ctrl-C; finished results are kept
};

/// Prints results to standard output and messages to standard error. If standard error is a terminal, a
/// progress line is kept below the messages.
class Console {
 public:
  /// `verb` is the prefix of each message ("waymark detect: …"). Fields named in texts are printed as flags
  /// of the program (with_flags()), and fields of errors as flags of the verb if `has_own` is true for them.
  /// Inputs keep their names. If `has_flag` is empty, fields are printed unchanged.
  explicit Console(std::string verb, std::FILE* out = stdout, std::FILE* err = stderr, HasFlag has_flag = {},
                   HasFlag has_own = {});

  /// Prints results and flushes, so that they are not lost if the program crashes later.
  void print(std::string_view text);
  /// Prints help, without replacing fields with flags.
  void print_help(std::string_view text);
  /// Prints one message line: "waymark detect: message".
  void note(std::string_view message);
  /// Prints an error, with its field shown as the flag that sets it (naming_flag()).
  void note(const Error& error) { note(to_string(naming_flag(error, has_own_))); }
  /// Prints the error and returns the code, as in `return console.failed(error, ExitCode::Usage);`.
  [[nodiscard]] ExitCode failed(const Error& error, ExitCode code) {
    note(error);
    return code;
  }
  /// Prints each warning as "warning: ...", after folding them with folded_warnings().
  void warn(const std::vector<std::string>& warnings);
  /// Prints the first lines, then how many remain and `where_all`, which explains where to find them.
  void note_first(const std::vector<std::string>& lines, std::string_view where_all);
  /// Redraws the progress line ("12/60 photo.png"), at most ten times a second and only on a terminal.
  void progress(std::size_t done, std::size_t all, std::string_view what);
  /// Replaces the progress line with this text, at most as often as progress().
  void live(std::string_view line);
  void end_progress();

  /// The text with fields replaced by the program's flags.
  [[nodiscard]] std::string text_for_users(std::string_view text) const;

  /// Whether results can no longer be printed because the reader has closed the pipe or writing has failed.
  /// If so, the verb should stop.
  [[nodiscard]] bool output_ended() const { return output_ != Output::Open; }
  /// The exit code to return: SomeFailed if results were lost (a message has been printed), Ok if the reader
  /// closed the pipe, Interrupted for a failure after Ctrl-C, and `code` otherwise.
  [[nodiscard]] ExitCode finish(ExitCode code);

 private:
  /// Whether enough time has passed to redraw the line.
  [[nodiscard]] bool time_to_redraw();

  enum class Output : std::uint8_t { Open, ClosedByReader, Failed };

  std::string verb_;
  HasFlag has_flag_;
  HasFlag has_own_;
  std::FILE* out_;
  std::FILE* err_;
  bool on_terminal_ = false;  ///< whether standard error is a terminal
  bool progress_shown_ = false;
  std::int64_t last_progress_ms_ = 0;
  Output output_ = Output::Open;
};

// Print why a verb failed and return its exit code.

/// Returns 2 if the command line or the environment is invalid. The key of such an error is a field (there is
/// no source, or the key is between backticks), or its source is "environment". Returns 1 if a file is
/// unusable or could not be written. After Ctrl-C, Console::finish() replaces both with 130.
[[nodiscard]] ExitCode exit_code_of(const Error& error);

/// Prints the error and returns its exit code.
[[nodiscard]] ExitCode fail_with(const Error& error, Console& console);

/// Prints the error. Returns fail_usage() for InvalidArgument, and fail_with() otherwise.
[[nodiscard]] ExitCode fail_by_kind(const Error& error, Console& console);

/// Prints the error. Returns 2 or, if the error has a source such as a file or a device, exit_code_of().
[[nodiscard]] ExitCode fail_usage(const Error& error, Console& console);

/// Creates the control for a job: progress and notes are printed to the console, and Ctrl-C cancels the job.
[[nodiscard]] JobControl control_from(Console& console);

/// During the lifetime of the result, `waymark stop` ends this drive as Ctrl-C does. If this cannot be set
/// up, prints a warning and returns nullptr.
[[nodiscard]] std::unique_ptr<StopSocket> listen_for_stop(const std::string& drive, Console& console);

}  // namespace waymark::cli
