#include "waymark/drivers/v4l2/device.hpp"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace waymark::internal {
namespace {

constexpr const char* kListHint = "`waymark cameras` lists the cameras of this computer.";

/// The permission that is missing, and how to get it.
Error no_permission(const std::string& path) {
  struct stat node {};
  const bool known = ::stat(path.c_str(), &node) == 0;
  const group* owner = known ? ::getgrgid(node.st_gid) : nullptr;  // NOLINT(concurrency-mt-unsafe): once
  if (owner == nullptr)
    return {ErrorCode::Unreadable, "this user may not open the camera", {.source = path}, kListHint};
  return {ErrorCode::Unreadable,
          fmt::format("this user may not open the camera: it is not in the group '{}'", owner->gr_name),
          {.source = path},
          fmt::format("sudo usermod -aG {} $USER, then log out and in again.", owner->gr_name)};
}

/// Whether one of the process's descriptors is the node.
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

}  // namespace

int control_device(int device, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ::ioctl(device, request, argument);
  } while (result == -1 && errno == EINTR);
  return result == -1 ? errno : 0;
}

std::string holder_of(const std::string& path) {
  char* resolved = ::realpath(path.c_str(), nullptr);
  const std::string node = resolved != nullptr ? resolved : path;
  std::free(resolved);  // NOLINT: realpath() allocates
  DIR* processes = ::opendir("/proc");
  if (processes == nullptr) return {};
  std::string holder;
  while (const dirent* entry = holder.empty() ? ::readdir(processes) : nullptr) {  // NOLINT
    const std::string number = entry->d_name;
    if (number.find_first_not_of("0123456789") != std::string::npos) continue;
    if (std::atoi(number.c_str()) == ::getpid()) continue;
    if (!has_open("/proc/" + number + "/fd", node)) continue;
    std::string name;
    std::ifstream file("/proc/" + number + "/comm");
    std::getline(file, name);
    holder = fmt::format("{} (process {})", name, number);
  }
  ::closedir(processes);
  return holder;
}

Error device_error(const std::string& path, const std::string& what, int error) {
  switch (error) {
    case EBUSY: {
      const std::string holder = holder_of(path);
      return {ErrorCode::Unreadable,
              holder.empty() ? "another program uses the camera" : holder + " uses the camera",
              {.source = path},
              "End that program, then try again."};
    }
    case EACCES:
    case EPERM:
      return no_permission(path);
    case ENOENT:
      return {ErrorCode::NotFound, "there is no such camera", {.source = path}, kListHint};
    case ENODEV:
    case ENXIO:
      return {ErrorCode::NotFound,
              "the camera is not plugged in any more",
              {.source = path},
              "Plug it in again, and check the cable and the hub."};
    case ENOSPC:
      return {ErrorCode::LimitExceeded,
              "the USB bus has no bandwidth left for this camera",
              {.source = path},
              "Plug it into another bus, or ask for MJPG, a smaller size or a lower rate."};
    default:
      return {ErrorCode::Unreadable,
              fmt::format("{}: {}", what, std::strerror(error)),  // NOLINT(concurrency-mt-unsafe)
              {.source = path},
              ""};
  }
}

Result<Descriptor> open_device(const std::string& path) {
  struct stat node {};
  if (::stat(path.c_str(), &node) != 0)
    return tl::unexpected(device_error(path, "cannot be looked up", errno));
  if (!S_ISCHR(node.st_mode))
    return fail(ErrorCode::Unsupported, "this is no camera, but a file", {.source = path}, kListHint);
  Descriptor device(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!device.open()) return tl::unexpected(device_error(path, "cannot be opened", errno));
  return device;
}

}  // namespace waymark::internal
