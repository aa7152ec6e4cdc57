#include "waymark/recording/byte_file.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <fmt/format.h>

#include "waymark/base/error.hpp"

namespace waymark {
namespace {

/// A file descriptor that is closed by the destructor.
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

// Unbuffered, so data that write() accepted are in the kernel and survive a crash of this process.
class FileSink final : public ByteSink {
 public:
  FileSink(int fd, std::filesystem::path path) : fd_(fd), path_(std::move(path)) {}

  Status write(ByteSpan bytes) override {
    ByteSpan rest = bytes;
    while (!rest.empty()) {
      const ssize_t written = ::write(fd_.get(), rest.data(), rest.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) {
        const bool full = errno == ENOSPC || errno == EFBIG || errno == EDQUOT;
        auto error =
            fail(ErrorCode::Unwritable, fmt::format("cannot write: {}", reason()), {.source = path_.string()},
                 !full        ? ""
                 : size_ == 0 ? "Free some space; nothing was recorded."
                              : "Free some space; what was recorded so far is kept.");
        take_back();
        return error;
      }
      rest = rest.subspan(static_cast<std::size_t>(written));
    }
    size_ += bytes.size();
    return {};
  }

  Status sync() override {
    // A pipe or device that cannot be synced (EINVAL) has no data to lose.
    if (::fdatasync(fd_.get()) != 0 && errno != EINVAL) {
      return fail(ErrorCode::Unwritable, fmt::format("cannot sync: {}", reason()),
                  {.source = path_.string()});
    }
    if (!named_) sync_name();
    named_ = true;
    return {};
  }

 private:
  // An incomplete chunk would precede the summary, which may still fit on the disk.
  void take_back() {
    const auto size = static_cast<off_t>(size_);
    if (::ftruncate(fd_.get(), size) == 0) (void)::lseek(fd_.get(), size, SEEK_SET);
  }
  // A new file survives a power cut only if its folder entry is synced too. Failures are ignored, because
  // nothing else can be done about them.
  void sync_name() const {
    const std::filesystem::path folder = path_.has_parent_path() ? path_.parent_path() : ".";
    const Descriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (fd.get() >= 0) (void)::fsync(fd.get());
  }

  Descriptor fd_;
  std::filesystem::path path_;
  std::uint64_t size_ = 0;
  bool named_ = false;
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
        return fail(ErrorCode::Unreadable, got == 0 ? "unexpected end of file" : reason(),
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
      return fail(ErrorCode::Unreadable, "unexpected end of file",
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
  if (fd >= 0) return std::make_unique<FileSink>(fd, path);
  const int error = errno;
  const std::string why = fmt::format("cannot create the file: {}", reason());
  const Place place{.source = path.string()};
  if (error != EEXIST)
    return fail(ErrorCode::Unwritable, why, place, write_hint(error, path.parent_path().string()));
  std::error_code ignored;
  const auto status = std::filesystem::status(path, ignored);
  if (std::filesystem::is_directory(status))
    return fail(ErrorCode::Unwritable, "this is a folder", place, "Give the name of a file.");
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    return fail(ErrorCode::Unwritable, "this is a device or a pipe, but a recording needs a regular file",
                place, "Give the name of a file.");
  return fail(ErrorCode::Unwritable, why, place,
              "Recordings are never overwritten: choose another name or remove the file.");
}

Error named_output(Error error, const std::filesystem::path& output) {
  error.place = {.source = output.string()};
  if (error.hint.starts_with("Free some space")) error.hint = "Free some space; nothing was written.";
  return error;
}

Status rename_to_new(const std::filesystem::path& from, const std::filesystem::path& to) {
  // link() fails if the name is taken, whereas rename() does not. Some file systems have no links.
  const bool linked = ::link(from.c_str(), to.c_str()) == 0;
  const bool no_links = !linked && (errno == EPERM || errno == EOPNOTSUPP || errno == EMLINK);
  std::error_code ignored;
  if (linked) {
    ::unlink(from.c_str());
    return {};
  }
  if (no_links && !std::filesystem::exists(to, ignored) && ::rename(from.c_str(), to.c_str()) == 0) return {};
  const bool taken = errno == EEXIST || std::filesystem::exists(to, ignored);
  return fail(ErrorCode::Unwritable, fmt::format("cannot rename the finished file: {}", reason()),
              {.source = to.string()}, taken ? "Files are never overwritten: choose another name." : "");
}

Result<std::unique_ptr<ByteSource>> open_file(const std::filesystem::path& path) {
  // Opened in non-blocking mode, because opening a pipe without a writer would otherwise block forever.
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  struct stat info {};
  if (fd >= 0 && ::fstat(fd, &info) == 0 && S_ISFIFO(info.st_mode)) {
    ::close(fd);
    return fail(ErrorCode::Unsupported, "this is a pipe, which does not support random access",
                {.source = path.string()}, "Write it to a file first.");
  }
  if (fd < 0) {
    return fail(errno == ENOENT ? ErrorCode::NotFound : ErrorCode::Unreadable,
                fmt::format("cannot open: {}", reason()), {.source = path.string()},
                "Check the path and its permissions.");
  }
  return std::make_unique<FileSource>(fd, path.string());
}

std::unique_ptr<ByteSource> memory_source(ByteSpan bytes, std::string name) {
  return std::make_unique<MemorySource>(bytes, std::move(name));
}

std::unique_ptr<ByteSink> memory_sink(Bytes& bytes) { return std::make_unique<MemorySink>(bytes); }

namespace {

/// Opens an unnamed file in `folder`; returns -1 and sets errno on failure. Uses O_TMPFILE if the file system
/// supports it. Otherwise (NFS, older overlays), a process that is killed between two calls leaves an empty
/// file behind.
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
                {.source = folder.string()}, "Set TMPDIR to a writable folder.");
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
                  {.source = folder_},
                  "Set TMPDIR to a folder with more free space, or unpack the file yourself.");
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
      return fail(
          ErrorCode::Unreadable,
          got == 0 ? "unexpected end of file" : std::strerror(errno),  // NOLINT(concurrency-mt-unsafe)
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
