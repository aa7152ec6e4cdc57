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

/// Where a writer puts its bytes, in order. Bytes accepted with success survive the death of the process.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// All of the bytes, or (where the medium can take back what it got) none of them.
  virtual Status write(ByteSpan bytes) = 0;
  /// Makes what was written survive a power cut, where the medium can.
  virtual Status sync() = 0;
};

/// Bytes at any offset, for readers.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Size now; a recording in progress grows.
  [[nodiscard]] virtual Result<std::uint64_t> size() const = 0;
  /// Fills all of `out` from `offset`, or fails.
  virtual Status read(std::uint64_t offset, std::span<std::uint8_t> out) const = 0;
  [[nodiscard]] virtual std::string name() const = 0;
};

/// A new file. Fails when it exists already: a recording is never overwritten.
[[nodiscard]] Result<std::unique_ptr<ByteSink>> create_file(const std::filesystem::path& path);
/// The error of a file that grew beside its place and is removed: it names the place, and nothing is kept.
[[nodiscard]] Error named_output(Error error, const std::filesystem::path& output);
/// Gives a finished file its name, in one step. Fails when the name is taken; the file keeps its old name
/// then.
[[nodiscard]] Status rename_to_new(const std::filesystem::path& from, const std::filesystem::path& to);
[[nodiscard]] Result<std::unique_ptr<ByteSource>> open_file(const std::filesystem::path& path);

/// Bytes in memory; they must outlive the source.
[[nodiscard]] std::unique_ptr<ByteSource> memory_source(ByteSpan bytes, std::string name = "memory");
/// Appends to bytes that must outlive the sink.
[[nodiscard]] std::unique_ptr<ByteSink> memory_sink(Bytes& bytes);

/// A file of our own in the system's folder for such ($TMPDIR), without a name: it is gone when the last
/// holder lets go, or this process ends, by whatever.
class TemporaryFile {
 public:
  static Result<std::shared_ptr<TemporaryFile>> create();
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  Status append(ByteSpan bytes);
  [[nodiscard]] Status read(std::uint64_t offset, std::span<std::uint8_t> out) const;
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// What others may still write to its disk.
  [[nodiscard]] std::uint64_t free_bytes() const;
  [[nodiscard]] int descriptor() const { return fd_; }

 private:
  TemporaryFile(int fd, std::string folder) : fd_(fd), folder_(std::move(folder)) {}

  int fd_;
  std::string folder_;
  std::uint64_t size_ = 0;
};

}  // namespace waymark
