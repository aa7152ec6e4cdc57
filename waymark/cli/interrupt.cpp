#include "waymark/cli/interrupt.hpp"

#include <csignal>

namespace waymark::cli {
namespace {

volatile std::sig_atomic_t interrupt_flag = 0;

extern "C" void raise_flag(int /*signal*/) { interrupt_flag = 1; }

}  // namespace

void watch_signals() {
  struct sigaction on_interrupt {};
  on_interrupt.sa_handler = raise_flag;
  on_interrupt.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
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

bool interrupted() { return interrupt_flag != 0; }

}  // namespace waymark::cli
