#include "waymark/codecs/png.hpp"

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstring>
#include <new>

#include <fmt/format.h>
#include <png.h>

#include "waymark/codecs/raw_pixels.hpp"

namespace waymark::codecs {
namespace {

constexpr std::size_t kMaxChunkMemory = std::size_t{8} << 20;  // limit for chunks other than pixels
constexpr std::uint64_t kMaxDeflateRatio =
    1032;  // RFC 1951: 258 bytes from one length bit and one distance bit

/// The pixels in one pass of an interlaced PNG (W3C, "Portable Network Graphics", section 8.2).
struct Pass {
  int x, y, step_x, step_y;
};
constexpr std::array kAdam7 = {Pass{0, 0, 8, 8}, Pass{4, 0, 8, 8}, Pass{0, 4, 4, 8}, Pass{2, 0, 4, 4},
                               Pass{0, 2, 2, 4}, Pass{1, 0, 2, 2}, Pass{0, 1, 1, 2}};

/// Decoder for one PNG. libpng reports errors with longjmp, which skips destructors. Therefore all memory is
/// owned by this object or its callers, and the skipped stack frames hold only plain values.
class PngReader {
 public:
  explicit PngReader(const Input& input) : input_(input) {
    png_ = png_create_read_struct(
        PNG_LIBPNG_VER_STRING, this,
        [](png_structp png, png_const_charp text) { self(png_get_error_ptr(png)).stop(text); },
        [](png_structp, png_const_charp) {});  // warnings concern unused chunks and are not printed to stderr
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  Result<ImageInfo> read_header() {
    if (info_ == nullptr)
      return fail(ErrorCode::LimitExceeded, "not enough memory for a PNG decoder", input_.whole());
    const bool good = guarded([this] {
      png_set_read_fn(png_, this, [](png_structp png, png_bytep to, png_size_t count) {
        self(png_get_io_ptr(png)).copy(to, count);
      });
      png_set_user_limits(png_, PNG_UINT_31_MAX,
                          PNG_UINT_31_MAX);  // check_limit() limits the number of pixels
      png_set_chunk_malloc_max(png_, kMaxChunkMemory);
      png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER, nullptr,
                                  -1);  // all chunks except the pixels and those needed to decode them
      png_read_info(png_, info_);
    });
    if (!good) return error();
    return ImageInfo{.format = ImageFormat::Png,
                     .width = static_cast<int>(png_get_image_width(png_, info_)),
                     .height = static_cast<int>(png_get_image_height(png_, info_)),
                     .channels = png_get_channels(png_, info_),
                     .bits_per_channel = png_get_bit_depth(png_, info_)};
  }

  Status read_pixels(Image& image, const DecodeOptions& /*options*/) {
    std::size_t row_bytes = 0;
    if (!guarded([&] {
          png_set_expand(png_);  // palette to RGB, 1..4 bits to 8, transparent colour to alpha
          png_read_update_info(png_, info_);
          row_bytes = png_get_rowbytes(png_, info_);
        })) {
      return error();
    }
    row_.resize(row_bytes);
    channels_ = png_get_channels(png_, info_);
    wide_ = png_get_bit_depth(png_, info_) == 16;
    const bool grey = channels_ == 1;  // as from sensors; colour images use the full range
    if (wide_ && grey)
      samples_.resize(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()));
    begin_ = image.row(0);
    const bool interlaced = png_get_interlace_type(png_, info_) == PNG_INTERLACE_ADAM7;
    const bool good = guarded([&] {
      if (interlaced) {
        read_passes(image);
      } else {
        for (int y = 0; y < image.height(); ++y) read_row(image.row(y), image.width(), 1);
      }
      png_read_end(png_, nullptr);  // requires the end chunk: a file without it is truncated
    });
    if (!good) return error();
    if (!samples_.empty()) narrow_grey(samples_, image);
    return {};
  }

  /// The compression ratio of deflate is limited, so a short file that claims more rows is rejected before
  /// memory is allocated.
  [[nodiscard]] Status check_plausible() const {
    const std::uint64_t width = png_get_image_width(png_, info_);
    const std::uint64_t height = png_get_image_height(png_, info_);
    const std::uint64_t bits = std::uint64_t{png_get_bit_depth(png_, info_)} * png_get_channels(png_, info_);
    const std::uint64_t raw_bytes = height * (1 + (width * bits + 7) / 8);
    if (raw_bytes / kMaxDeflateRatio <= input_.bytes.size()) return {};
    return cut_short(input_, fmt::format("PNG of {} x {} px cannot fit into {} bytes", width, height,
                                         input_.bytes.size()));
  }

 private:
  static PngReader& self(void* pointer) { return *static_cast<PngReader*>(pointer); }

  /// Runs C calls; returns false if libpng fails.
  template <class Calls>
  bool guarded(Calls calls) {
    if (setjmp(jump_) != 0) return false;
    calls();
    return true;
  }

  [[noreturn]] void stop(const char* text) {
    std::strncpy(message_.data(), text, message_.size() - 1);
    std::longjmp(jump_, 1);
  }

  void copy(std::uint8_t* to, std::size_t count) {
    if (count > input_.bytes.size() - position_) {
      cut_short_ = true;
      stop("end of input");
    }
    std::copy_n(input_.bytes.data() + position_, count, to);
    position_ += count;
  }

  /// Writes the pixels of each of the seven Adam7 passes directly to their final positions, without a second
  /// image in memory.
  void read_passes(Image& image) {
    for (const Pass& pass : kAdam7) {
      if (pass.x >= image.width()) continue;  // passes without pixels are not stored in the file
      const int columns = (image.width() - pass.x + pass.step_x - 1) / pass.step_x;
      for (int y = pass.y; y < image.height(); y += pass.step_y)
        read_row(image.row(y) + pass.x, columns, pass.step_x);
    }
  }

  /// Writes the next row of the file to every `step`-th byte of `to`.
  void read_row(std::uint8_t* to, int count, int step) {
    png_read_row(png_, row_.data(), nullptr);
    const std::uint64_t max = wide_ ? 65535 : 255;
    const bool alpha = channels_ == 2 || channels_ == 4;
    const std::uint8_t* from = row_.data();
    const auto next = [&]() -> std::uint64_t {
      const std::uint64_t high = *from++;
      return wide_ ? (high << 8U) + *from++ : high;
    };
    for (int i = 0; i < count; ++i) {
      const std::uint64_t first = next();
      if (!samples_.empty())
        samples_[static_cast<std::size_t>(to - begin_) + static_cast<std::size_t>(i * step)] =
            static_cast<std::uint16_t>(first);
      std::uint64_t luma = 1000 * first;
      if (channels_ >= 3) {
        const std::uint64_t green = next();
        luma = luma_1000(first, green, next());
      }
      const std::uint64_t opacity = alpha ? next() : max;
      to[static_cast<std::ptrdiff_t>(i) * step] = grey_byte_over_white(luma, opacity, max);
    }
  }

  [[nodiscard]] tl::unexpected<Error> error() const {
    if (cut_short_) return cut_short(input_, "PNG ends before the image is complete");
    const std::string_view text = message_.data();
    if (text.find("memory") != std::string_view::npos) {
      return fail(ErrorCode::LimitExceeded, fmt::format("PNG needs more memory than allowed: {}", text),
                  input_.whole());
    }
    return fail(ErrorCode::Unreadable, fmt::format("damaged PNG: {}", text), input_.at(position_),
                "Copy or save the file again.");
  }

  Input input_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::jmp_buf jump_{};
  std::array<char, 200> message_{};
  std::size_t position_ = 0;
  bool cut_short_ = false;
  std::vector<std::uint8_t> row_;
  int channels_ = 1;
  bool wide_ = false;
  std::vector<std::uint16_t> samples_;  ///< samples of a 16-bit grey image; otherwise empty
  const std::uint8_t* begin_ = nullptr;
};

}  // namespace

Result<ImageInfo> probe_png(const Input& input) {
  PngReader reader(input);
  return reader.read_header();
}

Result<Image> decode_png(const Input& input, const DecodeOptions& options) {
  PngReader reader(input);
  return decode_by(reader, input, options);
}

namespace {

/// Encodes one PNG. As in the reader, the stack frames that longjmp skips own nothing.
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
  /// Exceptions must not cross libpng's stack frames.
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
