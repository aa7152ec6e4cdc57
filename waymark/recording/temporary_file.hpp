#pragma once

#include <filesystem>
#include <memory>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_file.hpp"

namespace waymark {

/// A file of our own in the system's folder for such ($TMPDIR), removed when the last holder lets go.
class TemporaryFile {
 public:
  static Result<std::shared_ptr<TemporaryFile>> create();
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  Status append(ByteSpan bytes);
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  TemporaryFile(int fd, std::filesystem::path path) : fd_(fd), path_(std::move(path)) {}

  int fd_;
  std::filesystem::path path_;
  std::uint64_t size_ = 0;
};

}  // namespace waymark
