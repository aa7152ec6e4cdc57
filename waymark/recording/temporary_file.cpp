#include "waymark/recording/temporary_file.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

namespace waymark {

namespace {

/// The descriptor of a file without a name in `folder`, or -1 and errno. Never named where the file system
/// has O_TMPFILE; elsewhere (NFS, older overlays) a process killed between two calls leaves an empty file.
int open_unnamed(const std::filesystem::path& folder) {
  const int unnamed = ::open(folder.c_str(), O_TMPFILE | O_EXCL | O_RDWR | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (unnamed >= 0) return unnamed;
  std::string path = (folder / "waymark-XXXXXX").string();
  const int named = ::mkostemp(path.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(path.c_str());
  return named;
}

}  // namespace

Result<std::shared_ptr<TemporaryFile>> TemporaryFile::create() {
  std::error_code error;
  std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (error) folder = "/tmp";
  const int fd = open_unnamed(folder);
  if (fd < 0)
    return fail(ErrorCode::Unwritable,
                fmt::format("cannot create a temporary file: {}",
                            std::strerror(errno)),  // NOLINT(concurrency-mt-unsafe)
                {.source = folder.string()}, "Set TMPDIR to a folder that can be written.");
  return std::shared_ptr<TemporaryFile>(new TemporaryFile(fd, folder.string()));
}

TemporaryFile::~TemporaryFile() { ::close(fd_); }

Status TemporaryFile::append(ByteSpan bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0)
      return fail(ErrorCode::Unwritable,
                  fmt::format("cannot unpack: {}", std::strerror(errno)),  // NOLINT(concurrency-mt-unsafe)
                  {.source = folder_}, "Set TMPDIR to a folder with more room, or unpack it by hand.");
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    size_ += static_cast<std::uint64_t>(written);
  }
  return {};
}

Status TemporaryFile::read(std::uint64_t offset, std::span<std::uint8_t> out) const {
  while (!out.empty()) {
    const ssize_t got = ::pread(fd_, out.data(), out.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0)
      return fail(ErrorCode::Unreadable,
                  got == 0 ? "the file ends here" : std::strerror(errno),  // NOLINT(concurrency-mt-unsafe)
                  {.byte = static_cast<std::int64_t>(offset)});
    out = out.subspan(static_cast<std::size_t>(got));
    offset += static_cast<std::uint64_t>(got);
  }
  return {};
}

std::uint64_t TemporaryFile::free_bytes() const {
  struct statvfs disk {};
  if (::fstatvfs(fd_, &disk) != 0) return std::numeric_limits<std::uint64_t>::max();
  return static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize;
}

}  // namespace waymark
