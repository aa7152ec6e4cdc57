#include "waymark/app/cli/interrupt.hpp"

#include <atomic>
#include <csignal>
#include <string_view>

#include <unistd.h>

#include "waymark/base/time.hpp"
#include "waymark/inputs/keyboard/terminal_settings.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark::cli {
namespace {

std::atomic<bool> interrupt_flag{false};
std::atomic<bool> stop_requested{false};
std::atomic<int> ending_signal{SIGINT};
std::atomic<unsigned> seen_signals{0};  ///< a bit each
std::atomic<Duration::rep> first_seen{0};
static_assert(std::atomic<Duration::rep>::is_always_lock_free, "a signal handler sets it");
TerminalSettings terminal;  // keys may be read from it, without echo

/// timeout(1) and some shells send one signal to the program and again to its group.
constexpr Duration kSameKey = std::chrono::milliseconds(200);

/// The second time the same signal ends the program at once, as without a handler; that is said first.
extern "C" void raise_flag(int signal) {
  constexpr std::string_view kAtOnce =
      "\nwaymark: the second signal: ended at once, nothing more is written\n";
  const unsigned bit = 1U << static_cast<unsigned>(signal);
  const Duration now = steady_now();
  if ((seen_signals.fetch_or(bit) & bit) != 0) {
    if (now - Duration(first_seen) < kSameKey) return;
    put_back(terminal);
    (void)!write(STDERR_FILENO, kAtOnce.data(), kAtOnce.size());
    std::signal(signal, SIG_DFL);
    std::raise(signal);
    return;
  }
  first_seen = now.count();
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
