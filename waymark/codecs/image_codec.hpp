#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/image/image.hpp"

namespace waymark {

/// The image formats that can be read and written.
enum class ImageFormat : std::uint8_t { Jpeg, Png, Pnm };

/// "JPEG", "PNG", "PNM".
[[nodiscard]] std::string_view to_string(ImageFormat format);

/// Contents of an image header, read without decoding any pixels.
struct ImageInfo {
  ImageFormat format = ImageFormat::Png;
  int width = 0;     ///< [px]
  int height = 0;    ///< [px]
  int channels = 0;  ///< as stored: 1 for grey or palette, 2 for grey + alpha, 3 for colour, 4 for colour +
                     ///< alpha or CMYK
  int bits_per_channel = 0;  ///< as stored: 1, 2, 4, 8 or 16; for PNM, as many as its maximum needs

  friend bool operator==(const ImageInfo&, const ImageInfo&) = default;
};

/// Decoder limits for untrusted files.
struct DecodeOptions {
  std::int64_t max_pixels = 500'000'000;  ///< checked (LimitExceeded) before any allocation

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.max_pixels,
          Field{"max_pixels", "Largest accepted number of pixels of an image.", 1, 2147483647});
  }
};

/// The format of an image whose file begins with `head`; 8 bytes are enough. `nullopt` for any other file.
[[nodiscard]] std::optional<ImageFormat> image_format_of(std::span<const std::uint8_t> head);

/// Reads only the header: format (recognised from the content), size, channels and depth. `name` is the name
/// of the input in errors, usually its path. Errors: Unreadable (empty, truncated, malformed), Unsupported
/// (naming the actual format).
[[nodiscard]] Result<ImageInfo> probe(std::span<const std::uint8_t> bytes, std::string_view name);

/// Decodes an image to 8-bit grey.
///
/// Grey is Rec. 601 luma, (299 R + 587 G + 114 B) / 1000, of the stored samples (no gamma, no colour
/// profile). For a YCbCr JPEG it is the Y channel. CMYK and YCCK JPEGs are read in Adobe's inverted form, as
/// all common readers do: R = C K / 255. PNG transparency is composited over white, the colour of the paper
/// that tags are printed on. 16-bit samples and PNM with any maximum are scaled exactly and rounded once, to
/// nearest. A grey PNG that uses less than an eighth of its 16-bit range is stretched (narrow_grey()). EXIF
/// orientation is ignored: pixels stay as the sensor delivered them, as a calibration expects. Only the first
/// image of a PNM is read.
///
/// A truncated or damaged image is an Unreadable error, never an image with grey areas; the error contains
/// the byte at which reading stopped if the decoder reports it. Other errors: Unsupported, LimitExceeded
/// (options.max_pixels, memory).
[[nodiscard]] Result<Image> decode_image(std::span<const std::uint8_t> bytes, std::string_view name,
                                         const DecodeOptions& options = {});

/// Lossless PNG, 8-bit grey or RGB. Errors: InvalidArgument (empty image), LimitExceeded (memory).
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_png(const ImageView& image);
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_png(const ColorImage& image);

/// Baseline JPEG; quality 1 (small) to 100 (near lossless), chroma at full resolution. Errors:
/// InvalidArgument (empty image, quality), Unsupported (a side longer than 65500 px), LimitExceeded (memory).
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_jpeg(const ImageView& image, int quality);
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_jpeg(const ColorImage& image, int quality);

/// Lossless raw PNM: P5 (grey) or P6 (RGB), maximum 255. Errors: InvalidArgument (empty image).
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_pnm(const ImageView& image);
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_pnm(const ColorImage& image);

}  // namespace waymark
