#pragma once

#include <memory>
#include <string>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_file.hpp"

namespace waymark {

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
