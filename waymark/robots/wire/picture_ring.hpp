#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>

#include "waymark/base/error.hpp"

namespace waymark {

/// Pictures on their way to another process, as files in memory: a folder of ten names in turn, in /dev/shm
/// where it is there. Each is whole when it has its name. The folder goes with this.
class PictureRing {
 public:
  static Result<PictureRing> make();
  ~PictureRing();
  PictureRing(PictureRing&& other) noexcept : folder_(std::exchange(other.folder_, {})), next_(other.next_) {}
  PictureRing(const PictureRing&) = delete;
  PictureRing& operator=(const PictureRing&) = delete;
  PictureRing& operator=(PictureRing&&) = delete;

  /// The path of the file with these bytes; it is overwritten ten pictures later.
  Result<std::string> put(std::span<const std::uint8_t> bytes);
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  explicit PictureRing(std::filesystem::path folder) : folder_(std::move(folder)) {}

  std::filesystem::path folder_;
  unsigned next_ = 0;
};

}  // namespace waymark
