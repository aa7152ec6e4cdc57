#include "waymark/robots/process/sender_watch.hpp"

#include <array>

#include <fmt/format.h>
#include <unistd.h>

namespace waymark {

Status SenderWatch::alone(const std::string& where, const std::string& who, const std::string& start) const {
  if (listen_ == Duration(0) || commands_ < kCommandsOfADriver) return {};
  return fail(ErrorCode::InvalidArgument,
              fmt::format("another program commands this robot{}: {} commands in {:.1f} s",
                          who.empty() ? "" : ", " + who, commands_, to_seconds(listen_)),
              {.source = where},
              fmt::format("End it. Where both are meant to drive: --robot \"process:waymark {} "
                          "--share-commands\" --robot-file NAME.",
                          start));
}

std::string name_of_this_process() {
  std::array<char, 65> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host[0] = '?';
  return fmt::format("waymark (process {} on {})", getpid(), host.data());
}

}  // namespace waymark
