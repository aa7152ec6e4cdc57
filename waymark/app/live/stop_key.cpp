#include "waymark/app/live/stop_key.hpp"

#include <string>
#include <utility>

#include <unistd.h>

namespace waymark {
namespace {

/// Whoever is in the background and touches the terminal it was started from is stopped by it, and the robot
/// with it.
bool in_foreground() {
  const pid_t group = tcgetpgrp(STDIN_FILENO);
  return group < 0 || group == getpgrp();
}

}  // namespace

StopKey::StopKey(bool taken) {
  if (taken || !in_foreground()) return;
  auto keys = TerminalKeys::open(STDIN_FILENO);
  if (keys) keys_ = std::move(*keys);
}

bool StopKey::pressed() {
  if (!keys_ || !in_foreground()) return false;
  const Result<std::string> typed = keys_->read();
  return typed && typed->find(' ') != std::string::npos;
}

}  // namespace waymark
