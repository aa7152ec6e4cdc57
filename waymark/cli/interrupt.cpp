#include "waymark/cli/interrupt.hpp"

#include <atomic>
#include <csignal>
#include <string_view>

#include <termios.h>
#include <unistd.h>

namespace waymark::cli {
namespace {

std::atomic<bool> interrupt_flag{false};
std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets it");

std::atomic<int> ending_signal{SIGINT};
std::atomic<unsigned> seen_signals{0};  ///< a bit each
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler sets it");

termios terminal_before{};
bool has_terminal = false;

/// The keyboard may be a driver's, without echo. A program in the background may not touch its terminal.
void restore_terminal() {
  if (has_terminal && tcgetpgrp(STDIN_FILENO) == getpgrp())
    tcsetattr(STDIN_FILENO, TCSANOW, &terminal_before);
}

/// The second time the same signal ends the program at once, as without a handler; that is said first.
extern "C" void raise_flag(int signal) {
  constexpr std::string_view kAtOnce =
      "\nwaymark: the second signal: ended at once, nothing more is written\n";
  const unsigned bit = 1U << static_cast<unsigned>(signal);
  if ((seen_signals.fetch_or(bit) & bit) != 0) {
    restore_terminal();
    (void)!write(STDERR_FILENO, kAtOnce.data(), kAtOnce.size());
    std::signal(signal, SIG_DFL);
    std::raise(signal);
    return;
  }
  ending_signal = signal;
  interrupt_flag = true;
}

}  // namespace

void watch_signals() {
  has_terminal = tcgetattr(STDIN_FILENO, &terminal_before) == 0;
  struct sigaction on_interrupt {};
  on_interrupt.sa_handler = raise_flag;
  on_interrupt.sa_flags = SA_RESTART;
  sigaction(SIGINT, &on_interrupt, nullptr);
  sigaction(SIGTERM, &on_interrupt, nullptr);
  struct sigaction on_hangup {};  // the terminal was closed; under nohup it does not matter
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

}  // namespace waymark::cli
