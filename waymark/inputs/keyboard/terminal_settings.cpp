#include "waymark/inputs/keyboard/terminal_settings.hpp"

#include <unistd.h>

namespace waymark {

TerminalSettings terminal_settings(int descriptor) {
  TerminalSettings settings{.descriptor = descriptor};
  settings.is_terminal = tcgetattr(descriptor, &settings.before) == 0;
  return settings;
}

void put_back(const TerminalSettings& settings) {
  if (settings.is_terminal && tcgetpgrp(settings.descriptor) == getpgrp())
    tcsetattr(settings.descriptor, TCSANOW, &settings.before);
}

}  // namespace waymark
