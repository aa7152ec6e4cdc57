#include "waymark/recording/temporary_file.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>

#include <unistd.h>

#include <fmt/format.h>

namespace waymark {

Result<std::shared_ptr<TemporaryFile>> TemporaryFile::create() {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  std::string path = ((error ? std::filesystem::path("/tmp") : folder) / "waymark-XXXXXX").string();
  const int fd = ::mkstemp(path.data());
  if (fd < 0)
    return fail(ErrorCode::Unwritable,
                fmt::format("cannot create a temporary file: {}",
                            std::strerror(errno)),  // NOLINT(concurrency-mt-unsafe)
                {.source = path}, "Set TMPDIR to a folder that can be written.");
  return std::shared_ptr<TemporaryFile>(new TemporaryFile(fd, path));
}

TemporaryFile::~TemporaryFile() {
  ::close(fd_);
  ::unlink(path_.c_str());
}

Status TemporaryFile::append(ByteSpan bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0)
      return fail(ErrorCode::Unwritable,
                  fmt::format("cannot unpack: {}", std::strerror(errno)),  // NOLINT(concurrency-mt-unsafe)
                  {.source = path_.string()}, "Set TMPDIR to a folder with more room, or unpack it by hand.");
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    size_ += static_cast<std::uint64_t>(written);
  }
  return {};
}

}  // namespace waymark
