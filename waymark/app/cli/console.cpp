#include "waymark/app/cli/console.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <map>
#include <string_view>
#include <utility>

#include <unistd.h>

#include <fmt/format.h>

#include "waymark/app/cli/flags.hpp"
#include "waymark/base/time.hpp"
#include "waymark/inputs/keyboard/terminal_keys.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark::cli {
namespace {

std::atomic<bool> interrupt_flag{false};
std::atomic<bool> stop_requested{false};
std::atomic<int> ending_signal{SIGINT};
std::atomic<unsigned> received_signals{0};  ///< one bit per signal
std::atomic<Duration::rep> first_received{0};
static_assert(std::atomic<Duration::rep>::is_always_lock_free, "a signal handler sets it");
TerminalSettings terminal;  // restored on exit, because echo is turned off while keys are read

/// timeout(1) and some shells send a signal to the program and then to its process group; both count as one
/// key press.
constexpr Duration kSameKeyPress = std::chrono::milliseconds(200);

/// The second occurrence of a signal prints a message and ends the program at once, as if there were no
/// handler.
extern "C" void raise_flag(int signal) {
  constexpr std::string_view kMessage =
      "\nwaymark: second signal: ended at once; unfinished files are not completed\n";
  const unsigned bit = 1U << static_cast<unsigned>(signal);
  const Duration now = steady_now();
  if ((received_signals.fetch_or(bit) & bit) != 0) {
    if (now - Duration(first_received) < kSameKeyPress) return;
    restore_terminal(terminal);
    (void)!write(STDERR_FILENO, kMessage.data(), kMessage.size());
    std::signal(signal, SIG_DFL);
    std::raise(signal);
    return;
  }
  first_received = now.count();
  ending_signal = signal;
  interrupt_flag = true;
}

}  // namespace

void watch_signals() {
  terminal = terminal_settings(STDIN_FILENO);
  struct sigaction on_interrupt {};
  on_interrupt.sa_handler = raise_flag;
  on_interrupt.sa_flags = SA_RESTART;
  sigaction(SIGINT, &on_interrupt, nullptr);
  sigaction(SIGTERM, &on_interrupt, nullptr);
  struct sigaction on_hangup {};  // the terminal was closed, which has no effect under nohup
  if (sigaction(SIGHUP, nullptr, &on_hangup) == 0 && on_hangup.sa_handler != SIG_IGN)
    sigaction(SIGHUP, &on_interrupt, nullptr);
  struct sigaction ignore {};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &ignore, nullptr);
  sigaction(SIGXFSZ, &ignore, nullptr);
}

void interrupt() {
  if (!interrupt_flag) stop_requested = true;
  interrupt_flag = true;
}

bool interrupted() { return interrupt_flag; }

const char* interrupted_by() {
  if (stop_requested) return "'waymark stop'";
  if (ending_signal == SIGHUP) return "the closed terminal";
  return ending_signal == SIGTERM ? "SIGTERM" : "Ctrl-C";
}

namespace {

/// The warning with each number replaced by "#".
std::string kind_of(const std::string& warning) {
  std::string kind;
  const auto in_number = [](char c) { return (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '+'; };
  for (const char c : warning) {
    if (!in_number(c))
      kind += c;
    else if (kind.empty() || kind.back() != '#')
      kind += '#';
  }
  return kind;
}

}  // namespace

std::vector<std::string> folded_warnings(const std::vector<std::string>& warnings) {
  constexpr std::size_t kShownOfAKind = 3;
  std::vector<std::vector<const std::string*>> kinds;
  std::map<std::string, std::size_t> at;
  for (const std::string& warning : warnings) {
    const auto [kind, added] = at.try_emplace(kind_of(warning), kinds.size());
    if (added) kinds.emplace_back();
    kinds[kind->second].push_back(&warning);
  }
  std::vector<std::string> result;
  for (const auto& alike : kinds) {
    // A fourth warning takes up no more space than the line that would report one more.
    const std::size_t shown = alike.size() <= kShownOfAKind + 1 ? alike.size() : kShownOfAKind;
    for (std::size_t i = 0; i < shown; ++i) result.push_back(*alike[i]);
    if (shown < alike.size())
      result.push_back(
          fmt::format("{} more warnings differ from the last one only in numbers; --json lists all",
                      alike.size() - shown));
  }
  return result;
}

namespace {

std::int64_t now_ms() {
  const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(since_start).count();
}

/// Ignores failures, because failing to write a message (closed pipe, full disk) is no reason to stop.
void put(std::FILE* file, std::string_view text) {
  static_cast<void>(std::fwrite(text.data(), 1, text.size(), file));
  static_cast<void>(std::fflush(file));
}

}  // namespace

Console::Console(std::string verb, std::FILE* out, std::FILE* err, HasFlag has_flag, HasFlag has_own)
    : verb_(std::move(verb)),
      has_flag_(std::move(has_flag)),
      has_own_(has_own ? std::move(has_own) : has_flag_),
      out_(out),
      err_(err),
      on_terminal_(isatty(fileno(err)) == 1) {}

std::string Console::text_for_users(std::string_view text) const {
  return has_flag_ ? with_flags(text, has_flag_) : std::string(text);
}

void Console::print(std::string_view text) { print_help(text_for_users(text)); }

void Console::print_help(std::string_view text) {
  if (output_ended()) return;
  end_progress();
  errno = 0;
  const bool written =
      std::fwrite(text.data(), 1, text.size(), out_) == text.size() && std::fflush(out_) == 0;
  if (written) return;
  output_ = errno == EPIPE ? Output::ClosedByReader : Output::Failed;
  if (output_ == Output::Failed) {
    note(fmt::format("cannot write to standard output: {}. The results are incomplete.",
                     std::strerror(errno)));
  }
}

void Console::note(std::string_view message) {
  end_progress();
  put(err_, fmt::format("{}: {}\n", verb_, text_for_users(message)));
}

void Console::warn(const std::vector<std::string>& warnings) {
  for (const std::string& warning : folded_warnings(warnings)) note("warning: " + warning);
}

void Console::note_first(const std::vector<std::string>& lines, std::string_view where_all) {
  constexpr std::size_t kMaxLines = 12;
  const std::size_t shown = lines.size() > kMaxLines + 1 ? kMaxLines : lines.size();
  for (std::size_t i = 0; i < shown; ++i) note(lines[i]);
  if (shown < lines.size()) note(fmt::format("and {} more: {}", lines.size() - shown, where_all));
}

bool Console::time_to_redraw() {
  constexpr std::int64_t kRedrawMs = 100;
  if (!on_terminal_ || now_ms() - last_progress_ms_ < kRedrawMs) return false;
  last_progress_ms_ = now_ms();
  progress_shown_ = true;
  return true;
}

void Console::live(std::string_view line) {
  if (!time_to_redraw()) return;
  put(err_, fmt::format("\r\x1b[K{}", line));
}

void Console::progress(std::size_t done, std::size_t all, std::string_view what) {
  if (all < 2 || !time_to_redraw()) return;
  constexpr std::size_t kBar = 20;
  constexpr std::size_t kName = 40;
  const std::size_t filled = kBar * done / all;
  const std::string_view tail = what.substr(what.size() - std::min(what.size(), kName));
  put(err_, fmt::format("\r\x1b[K[{:#<{}}{:.<{}}] {}/{} {}", "", filled, "", kBar - filled, done, all, tail));
}

void Console::end_progress() {
  if (!progress_shown_) return;
  progress_shown_ = false;
  put(err_, "\r\x1b[K");
}

ExitCode Console::finish(ExitCode code) {
  end_progress();
  if (output_ == Output::Failed) return ExitCode::SomeFailed;
  if (output_ == Output::ClosedByReader) return ExitCode::Ok;
  const bool failed = code == ExitCode::SomeFailed || code == ExitCode::Usage;
  return failed && interrupted() ? ExitCode::Interrupted : code;
}

Error naming_flag(Error error, const HasFlag& has_flag) {
  if (!error.place.source.empty() || error.place.key.empty() || !has_flag) return error;
  if (std::string flag = flag_name(error.place.key); has_flag(flag)) error.place.key = std::move(flag);
  return error;
}

ExitCode exit_code_of(const Error& error) {
  const Place& place = error.place;
  const bool is_field = !place.key.empty() && (place.source.empty() || place.key.front() == '`');
  return is_field || place.source == "environment" ? ExitCode::Usage : ExitCode::SomeFailed;
}

ExitCode fail_with(const Error& error, Console& console) {
  return console.failed(error, exit_code_of(error));
}

ExitCode fail_by_kind(const Error& error, Console& console) {
  return error.code == ErrorCode::InvalidArgument ? fail_usage(error, console) : fail_with(error, console);
}

ExitCode fail_usage(const Error& error, Console& console) {
  return console.failed(error, error.place.source.empty() ? ExitCode::Usage : exit_code_of(error));
}

JobControl control_from(Console& console) {
  JobControl control;
  control.cancelled = interrupted;
  control.progress = [&console](const JobProgress& now) {
    if (now.all > 0)
      console.progress(now.done, now.all, now.text);
    else
      console.live(now.text);
  };
  control.note = [&console](const std::string& note) { console.note(note); };
  control.for_users = [&console](std::string_view text) { return console.text_for_users(text); };
  return control;
}

std::unique_ptr<StopSocket> listen_for_stop(const std::string& drive, Console& console) {
  const auto folder = stop_folder();
  auto socket = folder ? StopSocket::open(*folder, drive, interrupt)
                       : Result<std::unique_ptr<StopSocket>>(tl::unexpected(folder.error()));
  if (socket) return std::move(*socket);
  console.note("warning: " + to_string(socket.error()));
  return nullptr;
}

}  // namespace waymark::cli
