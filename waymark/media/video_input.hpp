#pragma once

#ifdef WAYMARK_HAVE_LIBAV

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "waymark/media/libav.hpp"

namespace waymark::internal {

/// The bytes of a video and how libavformat reads them: from one file or from memory, nothing else.
class VideoInput {
 public:
  /// NotFound, Unreadable (folder, empty, no permission), Unsupported (pipe, device).
  [[nodiscard]] static Result<std::unique_ptr<VideoInput>> of_file(const Libav& av,
                                                                   const std::filesystem::path& path);
  [[nodiscard]] static Result<std::unique_ptr<VideoInput>> of_bytes(const Libav& av,
                                                                    std::span<const std::uint8_t> bytes);
  VideoInput(const VideoInput&) = delete;
  VideoInput& operator=(const VideoInput&) = delete;
  ~VideoInput();

  [[nodiscard]] AVIOContext* context() const { return context_; }
  [[nodiscard]] std::int64_t size_bytes() const { return size_; }
  /// Where reading stands; the farthest byte that was asked for.
  [[nodiscard]] std::int64_t at() const { return at_; }
  /// The first bytes, at most 400.
  [[nodiscard]] std::span<const std::uint8_t> head() const { return head_; }

 private:
  explicit VideoInput(const Libav& av) : av_(av) {}
  [[nodiscard]] Status prepare();
  static int read(void* self, std::uint8_t* to, int size);
  static std::int64_t seek(void* self, std::int64_t offset, int whence);

  const Libav& av_;
  int file_ = -1;
  std::span<const std::uint8_t> bytes_{};
  std::int64_t size_ = 0;
  std::int64_t at_ = 0;
  std::vector<std::uint8_t> head_{};
  AVIOContext* context_ = nullptr;
};

}  // namespace waymark::internal

#endif
