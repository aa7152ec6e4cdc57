#include <png.h>

#include <array>
#include <csetjmp>
#include <cstring>
#include <new>

#include <fmt/format.h>

#include "waymark/codecs/formats.hpp"

namespace waymark::codecs {
namespace {

/// One PNG being written. As in the reader, no frame that longjmp skips owns anything.
class PngWriter {
 public:
  PngWriter() {
    png_ = png_create_write_struct(
        PNG_LIBPNG_VER_STRING, this,
        [](png_structp png, png_const_charp text) {
          static_cast<PngWriter*>(png_get_error_ptr(png))->stop(text);
        },
        [](png_structp, png_const_charp) {});
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngWriter() { png_destroy_write_struct(&png_, &info_); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;

  bool write(const Pixels& pixels) {
    if (info_ == nullptr || setjmp(jump_) != 0) return false;
    png_set_write_fn(png_, this, append, [](png_structp) {});
    png_set_user_limits(png_, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(pixels.width), static_cast<png_uint_32>(pixels.height),
                 8, pixels.channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png_, info_);
    for (int y = 0; y < pixels.height; ++y) png_write_row(png_, pixels.row(y));
    png_write_end(png_, nullptr);
    return true;
  }

  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(bytes_); }
  [[nodiscard]] const char* message() const { return message_.data(); }

 private:
  /// No exception may cross the frames of libpng.
  static void append(png_structp png, png_bytep data, png_size_t count) {
    auto& bytes = static_cast<PngWriter*>(png_get_io_ptr(png))->bytes_;
    bool stored = true;
    try {
      bytes.insert(bytes.end(), data, data + count);
    } catch (const std::bad_alloc&) {
      stored = false;
    }
    if (!stored) png_error(png, "out of memory");
  }

  [[noreturn]] void stop(const char* text) {
    std::strncpy(message_.data(), text, message_.size() - 1);
    std::longjmp(jump_, 1);
  }

  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::jmp_buf jump_{};
  std::array<char, 200> message_{};
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

Bytes encode_png(const Pixels& pixels) {
  PngWriter writer;
  if (!writer.write(pixels))
    return fail(ErrorCode::LimitExceeded, fmt::format("cannot encode PNG: {}", writer.message()));
  return writer.take();
}

}  // namespace waymark::codecs
