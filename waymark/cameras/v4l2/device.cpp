#include "waymark/cameras/v4l2/device.hpp"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "waymark/robots/watchdog/device_file.hpp"

namespace waymark::internal {
namespace {

constexpr const char* kListHint = "List the cameras of this computer with `waymark cameras`.";

}  // namespace

int control_device(int device, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ::ioctl(device, request, argument);
  } while (result == -1 && errno == EINTR);
  return result == -1 ? errno : 0;
}

Error device_error(const std::string& path, const std::string& what, int error) {
  switch (error) {
    case EBUSY: {
      const std::string holder = holder_of(path);
      return {ErrorCode::Unreadable,
              holder.empty() ? "another program uses the camera" : holder + " uses the camera",
              {.source = path},
              "Stop that program, then try again."};
    }
    case EACCES:
    case EPERM:
      return no_permission(path, "the camera", kListHint);
    case ENOENT:
      return {ErrorCode::NotFound, "no such camera", {.source = path}, kListHint};
    case ENODEV:
    case ENXIO:
      return {ErrorCode::NotFound,
              "the camera was unplugged",
              {.source = path},
              "Plug it in again, and check the cable and the hub."};
    case ENOSPC:
      return {ErrorCode::LimitExceeded,
              "the USB bus has no bandwidth left for this camera",
              {.source = path},
              "Plug it into another bus, or request MJPG, a smaller size or a lower rate."};
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
    return tl::unexpected(device_error(path, "cannot access the device", errno));
  if (!S_ISCHR(node.st_mode))
    return fail(ErrorCode::Unsupported, "a file, not a camera", {.source = path}, kListHint);
  Descriptor device(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!device.open()) return tl::unexpected(device_error(path, "cannot open the camera", errno));
  return device;
}

}  // namespace waymark::internal
