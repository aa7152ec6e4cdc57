// jpeglib.h needs these two first.
#include <cstddef>
#include <cstdio>

#include <jpeglib.h>

#include <array>
#include <csetjmp>
#include <cstdlib>

#include <fmt/format.h>

#include "waymark/codecs/formats.hpp"

namespace waymark::codecs {
namespace {

/// One JPEG being written, to memory that libjpeg grows. As in the reader, no frame that longjmp skips owns
/// anything.
class JpegWriter {
 public:
  JpegWriter() {
    cinfo_.err = jpeg_std_error(&errors_);
    errors_.error_exit = [](j_common_ptr c) { static_cast<JpegWriter*>(c->client_data)->stop(); };
    errors_.output_message = [](j_common_ptr) {};  // never to stderr
    cinfo_.client_data = this;
  }
  ~JpegWriter() {
    jpeg_destroy_compress(&cinfo_);
    std::free(buffer_);  // NOLINT(cppcoreguidelines-no-malloc): libjpeg took it with malloc
  }
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;

  bool write(const Pixels& pixels, int quality) {
    if (setjmp(jump_) != 0) return false;
    start(pixels, quality);
    while (cinfo_.next_scanline < cinfo_.image_height) {
      // The C interface is not const-correct; rows are only read.
      auto* row = const_cast<JSAMPROW>(pixels.row(static_cast<int>(cinfo_.next_scanline)));
      jpeg_write_scanlines(&cinfo_, &row, 1);
    }
    jpeg_finish_compress(&cinfo_);
    return true;
  }

  [[nodiscard]] std::vector<std::uint8_t> bytes() const { return {buffer_, buffer_ + size_}; }
  [[nodiscard]] const char* message() const { return message_.data(); }

 private:
  void start(const Pixels& pixels, int quality) {
    jpeg_create_compress(&cinfo_);
    cinfo_.client_data = this;
    jpeg_mem_dest(&cinfo_, &buffer_, &size_);
    cinfo_.image_width = static_cast<JDIMENSION>(pixels.width);
    cinfo_.image_height = static_cast<JDIMENSION>(pixels.height);
    cinfo_.input_components = pixels.channels;
    cinfo_.in_color_space = pixels.channels == 3 ? JCS_RGB : JCS_GRAYSCALE;
    jpeg_set_defaults(&cinfo_);
    jpeg_set_quality(&cinfo_, quality, TRUE);
    for (int i = 0; i < cinfo_.num_components; ++i) {  // thin coloured lines survive
      cinfo_.comp_info[i].h_samp_factor = 1;
      cinfo_.comp_info[i].v_samp_factor = 1;
    }
    jpeg_start_compress(&cinfo_, TRUE);
  }

  [[noreturn]] void stop() {
    cinfo_.err->format_message(reinterpret_cast<j_common_ptr>(&cinfo_), message_.data());
    std::longjmp(jump_, 1);
  }

  jpeg_compress_struct cinfo_{};
  jpeg_error_mgr errors_{};
  std::jmp_buf jump_{};
  std::array<char, JMSG_LENGTH_MAX> message_{};
  unsigned char* buffer_ = nullptr;
  unsigned long size_ = 0;
};

}  // namespace

Bytes encode_jpeg(const Pixels& pixels, int quality) {
  if (quality < 1 || quality > 100) {
    return fail(ErrorCode::InvalidArgument, fmt::format("JPEG quality {} is outside [1, 100]", quality),
                {.key = "quality"});
  }
  if (pixels.width > JPEG_MAX_DIMENSION || pixels.height > JPEG_MAX_DIMENSION) {
    return fail(ErrorCode::Unsupported,
                fmt::format("{} x {} px is too large for JPEG (at most {} a side)", pixels.width,
                            pixels.height, JPEG_MAX_DIMENSION),
                {}, "Write PNG.");
  }
  JpegWriter writer;
  if (!writer.write(pixels, quality)) {
    return fail(ErrorCode::LimitExceeded, fmt::format("cannot encode JPEG: {}", writer.message()));
  }
  return writer.bytes();
}

}  // namespace waymark::codecs
