#include "waymark/robots/watchdog/device_file.hpp"

#include <array>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include <dirent.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

namespace waymark {
namespace {

/// Whether one of the process's file descriptors refers to the path.
bool has_open(const std::string& folder, const std::string& path) {
  DIR* fds = ::opendir(folder.c_str());
  if (fds == nullptr) return false;
  bool found = false;
  while (const dirent* entry = found ? nullptr : ::readdir(fds)) {  // NOLINT(concurrency-mt-unsafe)
    std::array<char, 256> target{};
    const std::string link = folder + "/" + entry->d_name;
    const ssize_t length = ::readlink(link.c_str(), target.data(), target.size() - 1);
    found = length > 0 && path == target.data();
  }
  ::closedir(fds);
  return found;
}

/// The id of the process that holds a lock on the file, from the Linux lock table (proc(5), /proc/locks);
/// empty if there is none.
std::string locker_of(const std::string& path) {
  struct stat node {};
  if (::stat(path.c_str(), &node) != 0) return {};
  const std::string file =
      fmt::format("{:02x}:{:02x}:{}", major(node.st_dev), minor(node.st_dev), node.st_ino);
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream columns(line);
    std::string number;
    std::string kind;
    std::string mode;
    std::string access;
    std::string process;
    std::string locked;
    if (columns >> number >> kind >> mode >> access >> process >> locked && kind == "FLOCK" && locked == file)
      return process;
  }
  return {};
}

std::string name_of(const std::string& process) {
  std::string name;
  std::ifstream file("/proc/" + process + "/comm");
  std::getline(file, name);
  return fmt::format("{} (process {})", name, process);
}

}  // namespace

std::string holder_of(const std::string& path, bool maker_counts) {
  char* resolved = ::realpath(path.c_str(), nullptr);
  const std::string node = resolved != nullptr ? resolved : path;
  std::free(resolved);  // NOLINT: realpath() allocates
  const std::string locker = locker_of(node);
  if (!locker.empty() && locker != std::to_string(::getpid())) return name_of(locker);
  DIR* processes = ::opendir("/proc");
  if (processes == nullptr) return {};
  std::string holder;
  while (const dirent* entry = holder.empty() ? ::readdir(processes) : nullptr) {  // NOLINT
    const std::string number = entry->d_name;
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    if (std::atoi(number.c_str()) == ::getpid()) continue;
    const std::string descriptors = "/proc/" + number + "/fd";
    if (!has_open(descriptors, node)) continue;
    if (!maker_counts && (has_open(descriptors, "/dev/ptmx") || has_open(descriptors, "/dev/pts/ptmx")))
      continue;
    holder = name_of(number);
  }
  ::closedir(processes);
  return holder;
}

Error no_permission(const std::string& path, const std::string& what, const std::string& hint) {
  struct stat node {};
  const bool exists = ::stat(path.c_str(), &node) == 0;
  const group* owner = exists ? ::getgrgid(node.st_gid) : nullptr;  // NOLINT(concurrency-mt-unsafe): once
  const std::string message = "no permission to open " + what;
  if (owner == nullptr) return {ErrorCode::Unreadable, message, {.source = path}, hint};
  return {ErrorCode::Unreadable,
          fmt::format("{}: this user is not in group '{}'", message, owner->gr_name),
          {.source = path},
          fmt::format("Run `sudo usermod -aG {} $USER`, then log out and in again.", owner->gr_name)};
}

}  // namespace waymark
