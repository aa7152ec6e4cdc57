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

/// The image formats that are read and written.
enum class ImageFormat : std::uint8_t { Jpeg, Png, Pnm };

/// "JPEG", "PNG", "PNM".
[[nodiscard]] std::string_view to_string(ImageFormat format);

/// The header of an image, before any pixel is decoded.
struct ImageInfo {
  ImageFormat format = ImageFormat::Png;
  int width = 0;     ///< [px]
  int height = 0;    ///< [px]
  int channels = 0;  ///< as stored: 1 grey or palette, 2 grey + alpha, 3 colour, 4 colour + alpha or CMYK
  int bits_per_channel = 0;  ///< as stored: 1, 2, 4, 8 or 16; for PNM the bits that its maximum needs

  friend bool operator==(const ImageInfo&, const ImageInfo&) = default;
};

/// Limits of a decoder for untrusted files.
struct DecodeOptions {
  std::int64_t max_pixels = 500'000'000;  ///< more is a LimitExceeded error before any allocation

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.max_pixels,
          Field{"max_pixels", "Largest accepted number of pixels of an image.", 1, 2147483647});
  }
};

/// The format of an image whose file begins with `head`; 8 bytes are enough. Nothing for any other file.
[[nodiscard]] std::optional<ImageFormat> image_format_of(std::span<const std::uint8_t> head);

/// Reads only the header: format (recognised by content), size, channels, depth. `name` is the name of the
/// input in errors, usually its path. Errors: Unreadable (empty, truncated, malformed), Unsupported (the
/// error names the other format).
[[nodiscard]] Result<ImageInfo> probe(std::span<const std::uint8_t> bytes, std::string_view name);

/// Decodes an image to 8-bit grey.
///
/// Grey is Rec. 601 luma, (299 R + 587 G + 114 B) / 1000, of the stored samples (no gamma, no colour
/// profile). For a YCbCr JPEG it is the Y channel. CMYK and YCCK JPEG are read in Adobe's inverted form, as
/// by all common readers: R = C K / 255. PNG transparency is composited over white, the paper of a printed
/// tag. 16-bit samples and PNM with any maximum are scaled exactly and rounded once, to nearest. An EXIF
/// orientation is not applied: pixels stay as the sensor delivered them, as a calibration expects. Only the
/// first image of a PNM is read.
///
/// A truncated or damaged image is an error, never an image with grey parts: Unreadable, with the byte where
/// reading stopped if the decoder reports it. Other errors: Unsupported, LimitExceeded (options.max_pixels,
/// memory).
[[nodiscard]] Result<Image> decode_image(std::span<const std::uint8_t> bytes, std::string_view name,
                                         const DecodeOptions& options = {});

/// Lossless PNG, 8-bit grey or RGB. Errors: InvalidArgument (empty image), LimitExceeded (memory).
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_png(const ImageView& image);
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_png(const ColorImage& image);

/// Baseline JPEG; quality 1 (small) to 100 (near lossless), chroma at full resolution. Errors:
/// InvalidArgument (empty image, quality), Unsupported (a side above 65500 px), LimitExceeded (memory).
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_jpeg(const ImageView& image, int quality);
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_jpeg(const ColorImage& image, int quality);

/// Lossless raw PNM: P5 (grey) or P6 (RGB), maximum 255. Errors: InvalidArgument (empty image).
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_pnm(const ImageView& image);
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_pnm(const ColorImage& image);

}  // namespace waymark
