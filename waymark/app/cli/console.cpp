#include "waymark/app/cli/console.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include <unistd.h>

#include <fmt/format.h>

#include "waymark/app/cli/folded_warnings.hpp"
#include "waymark/app/cli/interrupt.hpp"

namespace waymark::cli {
namespace {

std::int64_t now_ms() {
  const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(since_start).count();
}

/// Words that nobody can read any more (a closed pipe, a full disk) are no reason to stop.
void put(std::FILE* file, std::string_view text) {
  static_cast<void>(std::fwrite(text.data(), 1, text.size(), file));
  static_cast<void>(std::fflush(file));
}

}  // namespace

Console::Console(std::string verb, std::FILE* out, std::FILE* err)
    : verb_(std::move(verb)), out_(out), err_(err), watched_(isatty(fileno(err)) == 1) {}

void Console::print(std::string_view text) {
  if (output_ended()) return;
  end_progress();
  errno = 0;
  const bool written =
      std::fwrite(text.data(), 1, text.size(), out_) == text.size() && std::fflush(out_) == 0;
  if (written) return;
  output_ = errno == EPIPE ? Output::ClosedByReader : Output::Failed;
  if (output_ == Output::Failed) {
    say(fmt::format("cannot write to standard output: {}. The results are incomplete.",
                    std::strerror(errno)));
  }
}

void Console::say(std::string_view words) {
  end_progress();
  put(err_, fmt::format("{}: {}\n", verb_, words));
}

void Console::warn(const std::vector<std::string>& warnings) {
  for (const std::string& warning : folded_warnings(warnings)) say("warning: " + warning);
}

void Console::say_first(const std::vector<std::string>& lines, std::string_view where_all) {
  constexpr std::size_t kMost = 12;
  const std::size_t shown = lines.size() > kMost + 1 ? kMost : lines.size();
  for (std::size_t i = 0; i < shown; ++i) say(lines[i]);
  if (shown < lines.size()) say(fmt::format("and {} more: {}", lines.size() - shown, where_all));
}

bool Console::time_to_redraw() {
  constexpr std::int64_t kRedrawMs = 100;
  if (!watched_ || now_ms() - last_progress_ms_ < kRedrawMs) return false;
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

}  // namespace waymark::cli
