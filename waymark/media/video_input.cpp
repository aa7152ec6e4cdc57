#include "waymark/media/video_input.hpp"

#ifdef WAYMARK_HAVE_LIBAV

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fmt/format.h>

namespace waymark::internal {
namespace {

constexpr int kBlock = 1 << 16;

Status check_kind(const struct stat& about) {
  if (S_ISDIR(about.st_mode))
    return fail(ErrorCode::Unreadable, "is a folder, not a video", {}, "Name the video file in it.");
  if (S_ISREG(about.st_mode)) return {};
  const bool pipe = S_ISFIFO(about.st_mode) || S_ISSOCK(about.st_mode);
  return fail(ErrorCode::Unsupported,
              pipe ? "is a pipe; a video is read from a file" : "is a device; a video is read from a file",
              {}, pipe ? "Write it to a file first: cat PIPE > walk.mp4" : "Record a video file first.");
}

}  // namespace

Result<std::unique_ptr<VideoInput>> VideoInput::of_file(const Libav& av, const std::filesystem::path& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0)
    return fail(errno == ENOENT ? ErrorCode::NotFound : ErrorCode::Unreadable,
                fmt::format("cannot open: {}", std::strerror(errno)));
  if (Status kind = check_kind(about); !kind) return tl::unexpected(kind.error());
  std::unique_ptr<VideoInput> input(new VideoInput(av));
  input->file_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (input->file_ < 0)
    return fail(ErrorCode::Unreadable, fmt::format("cannot open: {}", std::strerror(errno)));
  input->size_ = about.st_size;
  if (Status ready = input->prepare(); !ready) return tl::unexpected(ready.error());
  return input;
}

Result<std::unique_ptr<VideoInput>> VideoInput::of_bytes(const Libav& av,
                                                         std::span<const std::uint8_t> bytes) {
  std::unique_ptr<VideoInput> input(new VideoInput(av));
  input->bytes_ = bytes;
  input->size_ = static_cast<std::int64_t>(bytes.size());
  if (Status ready = input->prepare(); !ready) return tl::unexpected(ready.error());
  return input;
}

Status VideoInput::prepare() {
  if (size_ == 0) return fail(ErrorCode::Unreadable, "is empty");
  head_.resize(400);
  const int got = read(this, head_.data(), static_cast<int>(head_.size()));
  head_.resize(static_cast<std::size_t>(std::max(got, 0)));
  at_ = 0;
  auto* buffer = static_cast<unsigned char*>(av_.av_malloc(kBlock));
  if (buffer == nullptr) return fail(ErrorCode::LimitExceeded, "not enough memory");
  context_ = av_.avio_alloc_context(buffer, kBlock, 0, this, read, nullptr, seek);
  if (context_ == nullptr) {
    av_.av_free(buffer);
    return fail(ErrorCode::LimitExceeded, "not enough memory");
  }
  return {};
}

VideoInput::~VideoInput() {
  if (context_ != nullptr) {
    av_.av_freep(static_cast<void*>(&context_->buffer));
    av_.avio_context_free(&context_);
  }
  if (file_ >= 0) ::close(file_);
}

int VideoInput::read(void* opaque, std::uint8_t* to, int size) {
  auto* self = static_cast<VideoInput*>(opaque);
  const std::int64_t left = self->size_ - self->at_;
  if (left <= 0 || size <= 0) return AVERROR_EOF;
  const auto wanted = static_cast<std::size_t>(std::min<std::int64_t>(left, size));
  if (self->file_ < 0) {
    std::memcpy(to, self->bytes_.data() + self->at_, wanted);
    self->at_ += static_cast<std::int64_t>(wanted);
    return static_cast<int>(wanted);
  }
  ssize_t got = -1;
  do {
    got = ::pread(self->file_, to, wanted, self->at_);
  } while (got < 0 && errno == EINTR);
  if (got < 0) return AVERROR(errno);
  if (got == 0) return AVERROR_EOF;  // it became shorter since
  self->at_ += got;
  return static_cast<int>(got);
}

std::int64_t VideoInput::seek(void* opaque, std::int64_t offset, int whence) {
  auto* self = static_cast<VideoInput*>(opaque);
  if ((whence & AVSEEK_SIZE) != 0) return self->size_;
  switch (whence & ~AVSEEK_FORCE) {
    case SEEK_SET:
      break;
    case SEEK_CUR:
      offset += self->at_;
      break;
    case SEEK_END:
      offset += self->size_;
      break;
    default:
      return AVERROR(EINVAL);
  }
  if (offset < 0) return AVERROR(EINVAL);
  self->at_ = offset;
  return offset;
}

}  // namespace waymark::internal

#endif
