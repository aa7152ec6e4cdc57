#include "waymark/inputs/keyboard/terminal_keys.hpp"

#include <array>
#include <cerrno>
#include <cstring>

#include <poll.h>
#include <termios.h>
#include <unistd.h>

namespace waymark {

TerminalSettings terminal_settings(int descriptor) {
  TerminalSettings settings{.descriptor = descriptor};
  settings.is_terminal = tcgetattr(descriptor, &settings.before) == 0;
  return settings;
}

void restore_terminal(const TerminalSettings& settings) {
  if (settings.is_terminal && tcgetpgrp(settings.descriptor) == getpgrp())
    tcsetattr(settings.descriptor, TCSANOW, &settings.before);
}

TerminalKeys::TerminalKeys(const TerminalSettings& saved) : saved_(saved) {}

Result<std::unique_ptr<TerminalKeys>> TerminalKeys::open(int descriptor) {
  const TerminalSettings saved = terminal_settings(descriptor);
  if (!saved.is_terminal)
    return fail(ErrorCode::InvalidArgument, "standard input is not a terminal, so keys cannot be read", {},
                "Run it in a terminal, or use another `driver`.");
  termios raw = saved.before;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  if (tcsetattr(descriptor, TCSANOW, &raw) != 0)
    return fail(ErrorCode::InvalidArgument,
                std::string("cannot set the terminal to raw mode: ") + std::strerror(errno));
  return std::unique_ptr<TerminalKeys>(new TerminalKeys(saved));
}

TerminalKeys::~TerminalKeys() { (void)tcsetattr(saved_.descriptor, TCSANOW, &saved_.before); }

Result<std::string> TerminalKeys::read() {
  std::string bytes;
  pollfd ready{.fd = saved_.descriptor, .events = POLLIN, .revents = 0};
  while (poll(&ready, 1, 0) > 0) {
    if ((ready.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0)
      return fail(ErrorCode::Unreadable, "the terminal is gone");
    std::array<char, 256> buffer{};
    const auto count = ::read(saved_.descriptor, buffer.data(), buffer.size());
    if (count <= 0) break;
    bytes.append(buffer.data(), static_cast<std::size_t>(count));
  }
  return bytes;
}

}  // namespace waymark
