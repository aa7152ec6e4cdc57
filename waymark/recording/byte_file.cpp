#include "waymark/recording/byte_file.hpp"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

namespace waymark {
namespace {

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

std::string reason() { return std::strerror(errno); }  // NOLINT(concurrency-mt-unsafe)

// No buffer of our own: what write() returned from is with the kernel and survives our death.
class FileSink final : public ByteSink {
 public:
  FileSink(int fd, std::string name) : fd_(fd), name_(std::move(name)) {}

  Status write(ByteSpan bytes) override {
    while (!bytes.empty()) {
      const ssize_t written = ::write(fd_.get(), bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) {
        return fail(ErrorCode::Unwritable, fmt::format("cannot write: {}", reason()), {.source = name_},
                    errno == ENOSPC ? "Free some space; what was recorded so far is kept." : "");
      }
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    return {};
  }

  Status sync() override {
    // EINVAL: a pipe or device that cannot be synced has nothing to lose.
    if (::fdatasync(fd_.get()) != 0 && errno != EINVAL) {
      return fail(ErrorCode::Unwritable, fmt::format("cannot sync: {}", reason()), {.source = name_});
    }
    return {};
  }

 private:
  Descriptor fd_;
  std::string name_;
};

class FileSource final : public ByteSource {
 public:
  FileSource(int fd, std::string name) : fd_(fd), name_(std::move(name)) {}

  Result<std::uint64_t> size() const override {
    struct stat info {};
    if (::fstat(fd_.get(), &info) != 0) return fail(ErrorCode::Unreadable, reason(), {.source = name_});
    return static_cast<std::uint64_t>(info.st_size);
  }

  Status read(std::uint64_t offset, std::span<std::uint8_t> out) const override {
    while (!out.empty()) {
      const ssize_t got = ::pread(fd_.get(), out.data(), out.size(), static_cast<off_t>(offset));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) {
        return fail(ErrorCode::Unreadable, got == 0 ? "the file ends here" : reason(),
                    {.source = name_, .byte = static_cast<std::int64_t>(offset)});
      }
      out = out.subspan(static_cast<std::size_t>(got));
      offset += static_cast<std::uint64_t>(got);
    }
    return {};
  }

  std::string name() const override { return name_; }

 private:
  Descriptor fd_;
  std::string name_;
};

class MemorySource final : public ByteSource {
 public:
  MemorySource(ByteSpan bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}
  Result<std::uint64_t> size() const override { return bytes_.size(); }
  Status read(std::uint64_t offset, std::span<std::uint8_t> out) const override {
    if (offset > bytes_.size() || out.size() > bytes_.size() - offset) {
      return fail(ErrorCode::Unreadable, "the file ends here",
                  {.source = name_, .byte = static_cast<std::int64_t>(offset)});
    }
    if (!out.empty()) std::memcpy(out.data(), bytes_.data() + offset, out.size());
    return {};
  }
  std::string name() const override { return name_; }

 private:
  ByteSpan bytes_;
  std::string name_;
};

class MemorySink final : public ByteSink {
 public:
  explicit MemorySink(Bytes& bytes) : bytes_(bytes) {}
  Status write(ByteSpan bytes) override {
    append(bytes_, bytes);
    return {};
  }
  Status sync() override { return {}; }

 private:
  Bytes& bytes_;
};

}  // namespace

Result<std::unique_ptr<ByteSink>> create_file(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (fd < 0) {
    const bool exists = errno == EEXIST;
    return fail(ErrorCode::Unwritable, fmt::format("cannot create the file: {}", reason()),
                {.source = path.string()},
                exists ? "A recording is never overwritten: choose another name or remove it." : "");
  }
  return std::make_unique<FileSink>(fd, path.string());
}

Result<std::unique_ptr<ByteSource>> open_file(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    return fail(errno == ENOENT ? ErrorCode::NotFound : ErrorCode::Unreadable,
                fmt::format("cannot open: {}", reason()), {.source = path.string()});
  }
  return std::make_unique<FileSource>(fd, path.string());
}

std::unique_ptr<ByteSource> memory_source(ByteSpan bytes, std::string name) {
  return std::make_unique<MemorySource>(bytes, std::move(name));
}

std::unique_ptr<ByteSink> memory_sink(Bytes& bytes) { return std::make_unique<MemorySink>(bytes); }

}  // namespace waymark
