#include "waymark/drivers/keyboard/terminal_keys.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include <poll.h>
#include <termios.h>
#include <unistd.h>

namespace waymark {

struct TerminalKeys::Saved {
  termios settings{};
};

TerminalKeys::TerminalKeys(int descriptor, std::unique_ptr<Saved> saved)
    : descriptor_(descriptor), saved_(std::move(saved)) {}

Result<std::unique_ptr<TerminalKeys>> TerminalKeys::open(int descriptor) {
  auto saved = std::make_unique<Saved>();
  if (isatty(descriptor) == 0 || tcgetattr(descriptor, &saved->settings) != 0)
    return fail(ErrorCode::InvalidArgument,
                "standard input is not a terminal: there are no keys to drive with", {},
                "Run it in a terminal, or let another driver drive.");
  termios raw = saved->settings;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  if (tcsetattr(descriptor, TCSANOW, &raw) != 0)
    return fail(ErrorCode::InvalidArgument,
                std::string("the terminal cannot be put into raw mode: ") + std::strerror(errno));
  return std::unique_ptr<TerminalKeys>(new TerminalKeys(descriptor, std::move(saved)));
}

TerminalKeys::~TerminalKeys() { (void)tcsetattr(descriptor_, TCSANOW, &saved_->settings); }

Result<std::string> TerminalKeys::read() {
  std::string bytes;
  pollfd ready{.fd = descriptor_, .events = POLLIN, .revents = 0};
  while (poll(&ready, 1, 0) > 0) {
    if ((ready.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0)
      return fail(ErrorCode::Unreadable, "the terminal is gone");
    std::array<char, 256> buffer{};
    const auto count = ::read(descriptor_, buffer.data(), buffer.size());
    if (count <= 0) break;
    bytes.append(buffer.data(), static_cast<std::size_t>(count));
  }
  return bytes;
}

}  // namespace waymark
