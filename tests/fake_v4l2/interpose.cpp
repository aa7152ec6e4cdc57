/// Functions of libc that a program calls on a device node, for nodes in FAKE_V4L2; any other call is
/// forwarded.
// These functions carry libc's own names.
#undef _FORTIFY_SOURCE
#include <cerrno>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include "tests/fake_v4l2/fake_device.hpp"
#include "tests/fake_v4l2/kernel_call.hpp"

namespace {

constexpr unsigned kVideoGroup = 44;  // of Debian
constexpr unsigned kVideoMajor = 81;

std::mutex& guard() {
  static std::mutex one;
  return one;
}

std::map<int, std::unique_ptr<fake_v4l2::Device>>& devices() {
  static std::map<int, std::unique_ptr<fake_v4l2::Device>> all;
  return all;
}

/// The path in FAKE_V4L2 that replaces this one; empty if the path is not a fake device.
std::string replaced(const char* path) {
  const char* folder = std::getenv("FAKE_V4L2");
  if (folder == nullptr || path == nullptr) return {};
  const bool ours = std::strncmp(path, "/dev/video", 10) == 0 || std::strncmp(path, "/dev/v4l", 8) == 0 ||
                    std::strcmp(path, "/dev") == 0 || std::strcmp(path, "/dev/") == 0;
  return ours ? std::string(folder) + path : std::string();
}

/// The description of a node, following links.
std::string node_of(const char* path) {
  const std::string to = replaced(path);
  char* resolved = to.empty() ? nullptr : ::realpath(to.c_str(), nullptr);
  const std::string node = resolved == nullptr ? std::string() : resolved;
  std::free(resolved);
  return node;
}

bool is_node(const char* path) {
  return path != nullptr && !replaced(path).empty() && std::strncmp(path, "/dev/v", 6) == 0;
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

int open_node(const char* path) {
  const std::string node = node_of(path);
  if (node.empty()) {
    errno = ENOENT;
    return -1;
  }
  if (fake_v4l2::fault("denied")) {
    errno = EACCES;
    return -1;
  }
  auto device = std::make_unique<fake_v4l2::Device>(std::getenv("FAKE_V4L2"), node);
  const int number = device->descriptor();
  const std::scoped_lock hold(guard());
  devices()[number] = std::move(device);
  return number;
}

/// Whether a third argument was passed to open(). O_TMPFILE contains the bit of O_DIRECTORY, which has none.
bool has_mode(int flags) { return (flags & O_CREAT) != 0 || (flags & O_TMPFILE) == O_TMPFILE; }

int open_any(const char* path, int flags, unsigned mode) {
  if (is_node(path) && (flags & O_DIRECTORY) == 0) return open_node(path);
  return static_cast<int>(fake_v4l2::kernel_call(SYS_openat, AT_FDCWD, path, flags, mode));
}

int stat_any(const char* path, struct stat* to) {
  if (!is_node(path)) return static_cast<int>(fake_v4l2::kernel_call(SYS_newfstatat, AT_FDCWD, path, to, 0));
  const std::string node = node_of(path);
  if (node.empty()) {
    errno = ENOENT;
    return -1;
  }
  std::memset(to, 0, sizeof *to);
  to->st_mode = S_IFCHR | 0660;
  to->st_gid = kVideoGroup;
  to->st_rdev =
      makedev(kVideoMajor, static_cast<unsigned>(std::atoi(node.c_str() + node.rfind("video") + 5)));
  return 0;
}

void* map_any(void* at, size_t size, int protection, int flags, int number, long offset) {
  const std::scoped_lock hold(guard());
  const auto found = number < 0 ? devices().end() : devices().find(number);
  const int from = found == devices().end() ? number : found->second->memory();
  return reinterpret_cast<void*>(fake_v4l2::kernel_call(SYS_mmap, at, size, protection, flags, from, offset));
}

}  // namespace

// NOLINTBEGIN
extern "C" {

int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const unsigned mode = has_mode(flags) ? va_arg(more, unsigned) : 0;
  va_end(more);
  return open_any(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const unsigned mode = has_mode(flags) ? va_arg(more, unsigned) : 0;
  va_end(more);
  return open_any(path, flags, mode);
}

int __open_2(const char* path, int flags) { return open_any(path, flags, 0); }
int __open64_2(const char* path, int flags) { return open_any(path, flags, 0); }

int close(int number) {
  {
    const std::scoped_lock hold(guard());
    devices().erase(number);
  }
  return static_cast<int>(fake_v4l2::kernel_call(SYS_close, number));
}

int ioctl(int number, unsigned long request, ...) {
  va_list more;
  va_start(more, request);
  void* argument = va_arg(more, void*);
  va_end(more);
  {
    const std::scoped_lock hold(guard());
    const auto found = devices().find(number);
    if (found != devices().end()) {
      const int error = found->second->call(request, argument);
      if (error != 0) errno = error;
      return error == 0 ? 0 : -1;
    }
  }
  return static_cast<int>(fake_v4l2::kernel_call(SYS_ioctl, number, request, argument));
}

void* mmap(void* at, size_t size, int protection, int flags, int number, off_t offset) {
  return map_any(at, size, protection, flags, number, offset);
}
void* mmap64(void* at, size_t size, int protection, int flags, int number, off64_t offset) {
  return map_any(at, size, protection, flags, number, offset);
}

int stat(const char* path, struct stat* to) { return stat_any(path, to); }
int stat64(const char* path, struct stat64* to) { return stat_any(path, reinterpret_cast<struct stat*>(to)); }

DIR* opendir(const char* path) {
  static const auto real = next<DIR* (*)(const char*)>("opendir");
  const std::string to = replaced(path);
  return real(to.empty() ? path : to.c_str());
}

ssize_t readlink(const char* path, char* to, size_t size) {
  const std::string from = replaced(path);
  return fake_v4l2::kernel_call(SYS_readlinkat, AT_FDCWD, from.empty() ? path : from.c_str(), to, size);
}

}  // extern "C"
// NOLINTEND
