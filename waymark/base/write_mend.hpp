#pragma once

#include <cerrno>
#include <string>

namespace waymark {

/// How to mend what errno says of a file that was to be written into `folder`; empty where that is not known.
[[nodiscard]] inline std::string write_mend(int error, const std::string& folder) {
  switch (error) {
    case ENOENT:
      return "Make the folder '" + folder + "' first.";
    case ENOTDIR:
      return "A part of this path is a file, where a folder is needed. Name another one.";
    case EACCES:
    case EPERM:
    case EROFS:
      return "Name a folder in which you may write.";
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
      return "Free some space or choose another disk.";
    default:
      return "";
  }
}

}  // namespace waymark
