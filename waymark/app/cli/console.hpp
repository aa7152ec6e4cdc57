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

/// The terminal interface of the program: results, messages, progress, exit codes, signals.
namespace waymark::cli {

/// Installs signal handlers. The first Ctrl-C (or SIGTERM) only sets a flag, so that the current image is
/// finished and results are kept. The second signal of the same kind prints a message and ends the program at
/// once. Writing to a closed pipe, or beyond the limit on file size, becomes an error instead of a signal.
void watch_signals();

/// The same as Ctrl-C, from any thread, for requests of `waymark stop` in another process.
void interrupt();

/// Whether Ctrl-C was pressed, or a stop was requested, since watch_signals().
[[nodiscard]] bool interrupted();
/// The cause as text: "Ctrl-C", "SIGTERM", "the closed terminal" or "'waymark stop'".
[[nodiscard]] const char* interrupted_by();

/// The first warnings of each kind and the count of the others. Two warnings are of the same kind if they
/// differ only in numbers (tag ids are numbers). Kinds keep the order of their first warning.
[[nodiscard]] std::vector<std::string> folded_warnings(const std::vector<std::string>& warnings);

/// The error with its field as the flag that users type: "(--tag-size-m): ...". Keys in a file, and fields
/// without a flag, stay unchanged.
[[nodiscard]] Error naming_flag(Error error, const HasFlag& has_flag);

/// The program's exit status.
enum class ExitCode : std::uint8_t {
  Ok = 0,            ///< all inputs processed, regardless of the results
  SomeFailed = 1,    ///< some input or output failed; the others were processed
  Usage = 2,         ///< invalid command line; nothing was done
  Interrupted = 130  ///< stopped by Ctrl-C; finished results are kept
};

/// Prints results to standard output and messages to standard error. If standard error is a terminal, a
/// progress line is redrawn below the messages.
class Console {
 public:
  /// `verb` is the prefix of each message ("waymark detect: …"). Fields named in texts are printed as flags
  /// of the program (with_flags()), the field of an error as a flag of the verb (`has_own`; an input keeps
  /// its name). Without `has_flag` they remain fields.
  explicit Console(std::string verb, std::FILE* out = stdout, std::FILE* err = stderr, HasFlag has_flag = {},
                   HasFlag has_own = {});

  /// Prints results and flushes, so that they are not lost if the program ends abnormally later.
  void print(std::string_view text);
  /// The same without replacing fields by flags: help.
  void print_help(std::string_view text);
  /// Prints one message line: "waymark detect: message".
  void note(std::string_view message);
  /// Prints an error, with its field as the flag that sets it (naming_flag()).
  void note(const Error& error) { note(to_string(naming_flag(error, has_own_))); }
  /// Prints the error and returns the code: `return console.failed(error, ExitCode::Usage);`
  [[nodiscard]] ExitCode failed(const Error& error, ExitCode code) {
    note(error);
    return code;
  }
  /// Prints "warning: ..." for each, folded by folded_warnings().
  void warn(const std::vector<std::string>& warnings);
  /// Prints the first lines, then the number of the remaining ones and `where_all`, which explains where to
  /// find them.
  void note_first(const std::vector<std::string>& lines, std::string_view where_all);
  /// Redraws the progress line ("12/60 photo.png"), at most ten times a second and only on a terminal.
  void progress(std::size_t done, std::size_t all, std::string_view what);
  /// Replaces the progress line by this text, at the same rate as progress().
  void live(std::string_view line);
  void end_progress();

  /// The text with fields replaced by flags of the program.
  [[nodiscard]] std::string text_for_users(std::string_view text) const;

  /// Whether results can no longer be printed, because the reader closed the pipe or writing failed. The verb
  /// should then stop.
  [[nodiscard]] bool output_ended() const { return output_ != Output::Open; }
  /// The exit code to return. SomeFailed if results were lost (a message was printed), Ok if the reader
  /// closed the pipe, Interrupted for a failure after Ctrl-C; else `code`.
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
  bool on_terminal_ = false;  ///< standard error is a terminal
  bool progress_shown_ = false;
  std::int64_t last_progress_ms_ = 0;
  Output output_ = Output::Open;
};

// Functions for the failure of a verb, with message and exit code.

/// Returns 2 for an error in the command line or the environment. Then the key is a field (no source, or a
/// key between backticks), or the source is "environment". Returns 1 for a file that is not usable or could
/// not be written. After Ctrl-C Console::finish() changes both to 130.
[[nodiscard]] ExitCode exit_code_of(const Error& error);

/// Prints the error and returns its exit code.
[[nodiscard]] ExitCode fail_with(const Error& error, Console& console);

/// Prints the error. Returns fail_usage() for InvalidArgument, else fail_with().
[[nodiscard]] ExitCode fail_by_kind(const Error& error, Console& console);

/// Prints the error. Returns 2, or for an error with a source, such as a file or a device, exit_code_of().
[[nodiscard]] ExitCode fail_usage(const Error& error, Console& console);

/// Control of a job: progress and notes go to the console, and Ctrl-C cancels.
[[nodiscard]] JobControl control_from(Console& console);

/// While the result lives, `waymark stop` ends this drive as Ctrl-C does. If that is not possible, prints a
/// warning and returns nullptr.
[[nodiscard]] std::unique_ptr<StopSocket> listen_for_stop(const std::string& drive, Console& console);

}  // namespace waymark::cli
