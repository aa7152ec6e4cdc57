#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_io.hpp"

namespace waymark {

/// Receives a writer's bytes in order. Bytes that write() accepted survive a crash of the process.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// Writes all of the bytes or, if the medium can be truncated, none of them.
  virtual Status write(ByteSpan bytes) = 0;
  /// Flushes the written bytes to the disk, if the medium supports it.
  virtual Status sync() = 0;
};

/// Random-access bytes for readers.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// The current size; a recording in progress grows.
  [[nodiscard]] virtual Result<std::uint64_t> size() const = 0;
  /// Fills all of `out` from `offset`, or fails.
  virtual Status read(std::uint64_t offset, std::span<std::uint8_t> out) const = 0;
  [[nodiscard]] virtual std::string name() const = 0;
};

/// Creates a file. Fails if it exists: a recording is never overwritten.
[[nodiscard]] Result<std::unique_ptr<ByteSink>> create_file(const std::filesystem::path& path);
/// Changes the place of an error to `output`, because the temporary file next to it, where the error
/// occurred, has been removed.
[[nodiscard]] Error named_output(Error error, const std::filesystem::path& output);
/// Renames a finished file atomically. Fails if a file with the new name exists; the file then keeps its old
/// name.
[[nodiscard]] Status rename_to_new(const std::filesystem::path& from, const std::filesystem::path& to);
[[nodiscard]] Result<std::unique_ptr<ByteSource>> open_file(const std::filesystem::path& path);

/// Bytes in memory, which must outlive the source.
[[nodiscard]] std::unique_ptr<ByteSource> memory_source(ByteSpan bytes, std::string name = "memory");
/// Appends to bytes that must outlive the sink.
[[nodiscard]] std::unique_ptr<ByteSink> memory_sink(Bytes& bytes);

/// An unnamed file in the system's temporary folder ($TMPDIR). It disappears when its last owner releases it
/// or when the process ends for any reason.
class TemporaryFile {
 public:
  static Result<std::shared_ptr<TemporaryFile>> create();
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  Status append(ByteSpan bytes);
  [[nodiscard]] Status read(std::uint64_t offset, std::span<std::uint8_t> out) const;
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Free space of its disk that remains available to other programs.
  [[nodiscard]] std::uint64_t free_bytes() const;
  [[nodiscard]] int descriptor() const { return fd_; }

 private:
  TemporaryFile(int fd, std::string folder) : fd_(fd), folder_(std::move(folder)) {}

  int fd_;
  std::string folder_;
  std::uint64_t size_ = 0;
};

}  // namespace waymark
