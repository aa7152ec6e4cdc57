#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/image/image.hpp"

namespace waymark {

/// Pixels as stored by a camera or in a message; not owned.
struct RawPixels {
  /// As in sensor_msgs/image_encodings: "mono8", "uyvy", "nv12", "bayer_rggb8", …
  std::string_view encoding{};
  int width = 0;              ///< [px]
  int height = 0;             ///< [px]
  std::size_t row_bytes = 0;  ///< bytes from one row of the first plane to the next
  bool big_endian = false;    ///< byte order of 16-bit pixels
  std::span<const std::uint8_t> bytes{};
};

/// Converts pixels to grey, for live cameras, recordings and messages alike. Colours become Rec. 601 luma, as
/// in decode_image(). Of YUV images, Y is used unchanged. For Bayer patterns, the luma is a weighted mean of
/// the 3 x 3 pixels around each pixel. 16-bit pixels are converted by narrow_grey(). The last row may lack
/// its padding, and the colour planes of NV12, NV21 and NV24 may be missing.
///
/// Fails on other encodings (Unsupported), and if the size does not match the bytes (Unreadable).
[[nodiscard]] Result<Image> grey_of(const RawPixels& pixels);

/// The encodings that grey_of() supports.
[[nodiscard]] std::vector<std::string> raw_encodings();
/// Fails (Unsupported) on other encodings.
[[nodiscard]] Status check_raw_encoding(std::string_view encoding);

/// Converts 16-bit samples, row by row, to 8-bit grey. The full range is mapped to the full range, unless the
/// samples use less than an eighth of it, as with 10-bit and 12-bit sensors and thermal cameras. Then the
/// range in use (without a few outliers) is stretched to 5 … 250, so that no pixel counts as saturated. `to`
/// must have as many pixels as there are samples.
void narrow_grey(std::span<const std::uint16_t> samples, Image& to);

}  // namespace waymark
