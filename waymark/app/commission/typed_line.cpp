#include "waymark/app/commission/typed_line.hpp"

#include <poll.h>
#include <unistd.h>

namespace waymark {

Result<std::string> typed_line(const std::function<bool()>& cancelled) {
  std::string line;
  while (!cancelled()) {
    pollfd ready{STDIN_FILENO, POLLIN, 0};
    constexpr int kSlice_ms = 100;
    if (poll(&ready, 1, kSlice_ms) <= 0) continue;
    char typed = 0;
    if (read(STDIN_FILENO, &typed, 1) != 1)
      return fail(ErrorCode::InvalidArgument, "nobody answers at standard input", {.key = "--yes"},
                  "Give --yes where no person is there, and the robot is where it may drive.");
    if (typed == '\n') return line;
    line += typed;
  }
  return fail(ErrorCode::Unreadable, "stopped");
}

}  // namespace waymark
