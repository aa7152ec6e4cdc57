#include "waymark/base/error.hpp"

#include <cerrno>

#include <fmt/format.h>

namespace waymark {

const char* to_string(ErrorCode code) {
  switch (code) {
    case ErrorCode::InvalidArgument:
      return "invalid_argument";
    case ErrorCode::NotFound:
      return "not_found";
    case ErrorCode::Unreadable:
      return "unreadable";
    case ErrorCode::Unwritable:
      return "unwritable";
    case ErrorCode::Unsupported:
      return "unsupported";
    case ErrorCode::LimitExceeded:
      return "limit_exceeded";
  }
  return "unknown";
}

std::string to_string(const Error& error) {
  std::string place = error.place.source;
  if (error.place.line) place += fmt::format(":{}", *error.place.line);
  if (error.place.byte) place += fmt::format("{}byte {}", place.empty() ? "" : " at ", *error.place.byte);
  if (!error.place.key.empty()) place += fmt::format("{}({})", place.empty() ? "" : " ", error.place.key);
  std::string text = place.empty() ? error.message : fmt::format("{}: {}", place, error.message);
  if (!error.hint.empty()) {
    const bool closed = text.ends_with('.') || text.ends_with('?') || text.ends_with('!');
    text += fmt::format("{} {}", closed ? "" : ".", error.hint);
  }
  return text;
}

std::string write_hint(int error, const std::string& folder) {
  switch (error) {
    case ENOENT:
      return "Create the folder '" + folder + "' first.";
    case ENOTDIR:
      return "A component of this path is a file, not a folder. Choose another path.";
    case EACCES:
    case EPERM:
    case EROFS:
      return "Choose a folder with write permission.";
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
      return "Free some space or choose another disk.";
    default:
      return "";
  }
}

}  // namespace waymark
