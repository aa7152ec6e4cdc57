#include "waymark/codecs/jpeg.hpp"

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include <fmt/format.h>

// Must be included after <cstddef> and <cstdio>, and before jerror.h.
#include <jpeglib.h>

#include <jerror.h>

namespace waymark::codecs {
namespace {

// Progressive files usually have about ten scans; each requires a pass over the image.
constexpr int kMaxScans = 200;

/// Whether libjpeg makes up pixel values after this warning. Other warnings (stray bytes between segments,
/// unknown versions) are harmless and common in webcam streams.
bool loses_pixels(int code) {
  constexpr std::array kCodes = {JWRN_ARITH_BAD_CODE, JWRN_BOGUS_PROGRESSION, JWRN_HIT_MARKER,
                                 JWRN_HUFF_BAD_CODE,  JWRN_JPEG_EOF,          JWRN_MUST_RESYNC,
                                 JWRN_NOT_SEQUENTIAL};
  return std::find(kCodes.begin(), kCodes.end(), code) != kCodes.end();
}

/// Decoder for one JPEG. libjpeg reports errors with longjmp, which skips destructors. Therefore all memory
/// is owned by this object or its callers, and the skipped stack frames hold only plain values.
class JpegReader {
 public:
  explicit JpegReader(const Input& input) : input_(input) {
    cinfo_.err = jpeg_std_error(&errors_);
    errors_.error_exit = [](j_common_ptr c) { self(c).stop(); };
    errors_.emit_message = [](j_common_ptr c, int level) {
      if (level < 0 && loses_pixels(c->err->msg_code)) self(c).stop();
    };
    errors_.output_message = [](j_common_ptr) {};  // never print to stderr
    source_.init_source = [](j_decompress_ptr) {};
    source_.term_source = [](j_decompress_ptr) {};
    source_.fill_input_buffer = [](j_decompress_ptr c) -> boolean { self(c).run_out(); };
    source_.skip_input_data = [](j_decompress_ptr c, long count) { self(c).skip(count); };
    source_.resync_to_restart = jpeg_resync_to_restart;
    progress_.progress_monitor = [](j_common_ptr c) { self(c).count_scans(); };
    cinfo_.client_data = this;
  }
  ~JpegReader() { jpeg_destroy_decompress(&cinfo_); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  Result<ImageInfo> read_header() {
    const bool good = guarded([this] {
      jpeg_create_decompress(&cinfo_);
      cinfo_.client_data = this;
      cinfo_.src = &source_;
      cinfo_.progress = &progress_;
      source_.next_input_byte = input_.bytes.data();
      source_.bytes_in_buffer = input_.bytes.size();
      jpeg_read_header(&cinfo_, TRUE);
    });
    if (!good) return error();
    return ImageInfo{.format = ImageFormat::Jpeg,
                     .width = static_cast<int>(cinfo_.image_width),
                     .height = static_cast<int>(cinfo_.image_height),
                     .channels = cinfo_.num_components,
                     .bits_per_channel = cinfo_.data_precision};
  }

  Status read_pixels(Image& image, const DecodeOptions& options) {
    const bool inks = cinfo_.jpeg_color_space == JCS_CMYK || cinfo_.jpeg_color_space == JCS_YCCK;
    if (!inks && cinfo_.jpeg_color_space == JCS_UNKNOWN) {
      return fail(ErrorCode::Unsupported,
                  fmt::format("JPEG with {} channels of unknown meaning", cinfo_.num_components),
                  input_.whole(), "Convert it to a grey or RGB image.");
    }
    row_.resize(inks ? 4 * static_cast<std::size_t>(image.width()) : 0);
    const bool good = guarded([&] {
      // The coefficients of a progressive file take 2 bytes per sample, in up to 4 channels.
      const auto memory = 8 * options.max_pixels + (std::int64_t{64} << 20);
      cinfo_.mem->max_memory_to_use =
          static_cast<long>(std::min<std::int64_t>(memory, std::numeric_limits<long>::max()));
      cinfo_.out_color_space = inks ? JCS_CMYK : JCS_GRAYSCALE;
      cinfo_.do_block_smoothing = FALSE;
      jpeg_start_decompress(&cinfo_);
      expect_all_channels();
      while (cinfo_.output_scanline < cinfo_.output_height) {
        std::uint8_t* to = image.row(static_cast<int>(cinfo_.output_scanline));
        JSAMPROW row = inks ? row_.data() : to;
        jpeg_read_scanlines(&cinfo_, &row, 1);
        if (inks) inks_to_grey(row, to, image.width());
      }
      jpeg_finish_decompress(&cinfo_);  // requires the end marker: a file without it is truncated
    });
    if (!good) return error();
    return {};
  }

  /// A Huffman-coded block takes at least one bit, so a short file that claims more blocks is rejected before
  /// memory is allocated.
  [[nodiscard]] Status check_plausible() const {
    if (cinfo_.arith_code) return {};
    std::uint64_t blocks = 0;
    for (int i = 0; i < cinfo_.num_components; ++i) {
      const jpeg_component_info& c = cinfo_.comp_info[i];
      blocks += std::uint64_t{c.width_in_blocks} * c.height_in_blocks;
    }
    if (blocks <= 8 * std::uint64_t{input_.bytes.size()}) return {};
    return cut_short(input_, fmt::format("JPEG of {} x {} px cannot fit into {} bytes", cinfo_.image_width,
                                         cinfo_.image_height, input_.bytes.size()));
  }

 private:
  template <class Common>
  static JpegReader& self(Common* cinfo) {
    return *static_cast<JpegReader*>(cinfo->client_data);
  }

  /// Runs C calls; returns false if libjpeg fails.
  template <class Calls>
  bool guarded(Calls calls) {
    if (setjmp(jump_) != 0) return false;
    calls();
    return true;
  }

  [[noreturn]] void stop() {
    cinfo_.err->format_message(reinterpret_cast<j_common_ptr>(&cinfo_), message_.data());
    std::longjmp(jump_, 1);
  }

  [[noreturn]] void run_out() {
    cinfo_.err->msg_code = JERR_INPUT_EOF;
    source_.bytes_in_buffer = 0;
    stop();
  }

  void skip(long count) {
    if (count <= 0) return;
    if (static_cast<std::size_t>(count) > source_.bytes_in_buffer) run_out();
    source_.next_input_byte += count;
    source_.bytes_in_buffer -= static_cast<std::size_t>(count);
  }

  /// A file with several scans may end before the scan of a channel; libjpeg then fills the channel with
  /// mid-grey.
  void expect_all_channels() {
    for (int i = 0; i < cinfo_.num_components; ++i) {
      const jpeg_component_info& channel = cinfo_.comp_info[i];
      const bool no_scan = channel.quant_table == nullptr;
      const bool no_mean =
          cinfo_.progressive_mode && cinfo_.coef_bits != nullptr && cinfo_.coef_bits[i][0] < 0;
      if (!channel.component_needed || (!no_scan && !no_mean)) continue;
      cinfo_.err->msg_code = JERR_MISSING_DATA;
      stop();
    }
  }

  void count_scans() {
    if (cinfo_.input_scan_number <= kMaxScans) return;
    too_many_scans_ = true;
    stop();
  }

  [[nodiscard]] tl::unexpected<Error> error() const {
    const std::size_t read = input_.bytes.size() - source_.bytes_in_buffer;
    const std::string text = message_.data();
    switch (errors_.msg_code) {
      case JERR_MISSING_DATA:
        return fail(ErrorCode::Unreadable, "damaged JPEG: a colour channel is missing", input_.at(read),
                    "Copy or save the file again.");
      case JERR_INPUT_EOF:
        return cut_short(input_, "JPEG ends before the image is complete");
      case JERR_BAD_PRECISION:
      case JERR_SOF_UNSUPPORTED:
      case JERR_CONVERSION_NOTIMPL:
      case JERR_FRACT_SAMPLE_NOTIMPL:
      case JERR_CCIR601_NOTIMPL:
        return fail(ErrorCode::Unsupported, fmt::format("unsupported kind of JPEG: {}", text),
                    input_.at(read), "Convert it to a baseline or progressive JPEG with 8 bits, or to PNG.");
      case JERR_OUT_OF_MEMORY:
      case JERR_NO_BACKING_STORE:
        return fail(ErrorCode::LimitExceeded, "JPEG needs more memory than allowed", input_.whole(),
                    "Reduce the size of the image or raise `max_pixels`.");
      default:
        break;
    }
    if (too_many_scans_) {
      return fail(ErrorCode::LimitExceeded, fmt::format("JPEG with more than {} scans", kMaxScans),
                  input_.at(read), "Save the image again with another program.");
    }
    return fail(ErrorCode::Unreadable, fmt::format("damaged JPEG: {}", text), input_.at(read),
                "Copy or save the file again.");
  }

  /// Adobe's inverted CMYK: the stored value is 255 - ink, so R = C K / 255.
  static void inks_to_grey(const std::uint8_t* cmyk, std::uint8_t* grey, int width) {
    for (int x = 0; x < width; ++x, cmyk += 4) {
      grey[x] = to_byte(luma_1000(cmyk[0], cmyk[1], cmyk[2]) * cmyk[3], std::uint64_t{1000} * 255 * 255);
    }
  }

  Input input_;
  jpeg_decompress_struct cinfo_{};
  jpeg_error_mgr errors_{};
  jpeg_source_mgr source_{};
  jpeg_progress_mgr progress_{};
  std::jmp_buf jump_{};
  std::array<char, JMSG_LENGTH_MAX> message_{};
  std::vector<std::uint8_t> row_;
  bool too_many_scans_ = false;
};

}  // namespace

Result<ImageInfo> probe_jpeg(const Input& input) {
  JpegReader reader(input);
  return reader.read_header();
}

Result<Image> decode_jpeg(const Input& input, const DecodeOptions& options) {
  JpegReader reader(input);
  return decode_by(reader, input, options);
}

namespace {

/// Encodes one JPEG into memory that libjpeg grows. As in the reader, the stack frames that longjmp skips own
/// nothing.
class JpegWriter {
 public:
  JpegWriter() {
    cinfo_.err = jpeg_std_error(&errors_);
    errors_.error_exit = [](j_common_ptr c) { static_cast<JpegWriter*>(c->client_data)->stop(); };
    errors_.output_message = [](j_common_ptr) {};  // never print to stderr
    cinfo_.client_data = this;
  }
  ~JpegWriter() {
    jpeg_destroy_compress(&cinfo_);
    std::free(buffer_);  // NOLINT(cppcoreguidelines-no-malloc): libjpeg allocated it with malloc
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
    for (int i = 0; i < cinfo_.num_components; ++i) {  // full chroma resolution keeps thin coloured lines
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
