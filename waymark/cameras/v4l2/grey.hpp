#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/image/image.hpp"

namespace waymark {

/// The pixel formats that are read; the names are the four characters of Video4Linux.
enum class PixelFormat : std::uint8_t { Grey, Nv12, Yuyv, Uyvy, Mjpg };

/// "GREY", "NV12", "YUYV", "UYVY", "MJPG".
[[nodiscard]] const char* to_string(PixelFormat format);
[[nodiscard]] std::optional<PixelFormat> pixel_format_named(std::string_view name);
[[nodiscard]] std::vector<std::string> pixel_format_names();

/// A picture as a device delivers it.
struct RawLayout {
  PixelFormat format = PixelFormat::Grey;
  int width = 0;   ///< [px]
  int height = 0;  ///< [px]
  int stride = 0;  ///< [byte] from row to row; MJPG has none

  friend bool operator==(const RawLayout&, const RawLayout&) = default;
};

/// How many bytes a whole picture of this layout has; 0 for MJPG.
[[nodiscard]] std::size_t bytes_of(const RawLayout& layout);

/// The luma of a picture, as stored: full range or 16 to 235. Unreadable: fewer bytes than the picture needs,
/// JPEG data that are damaged, or of another size than the layout says.
[[nodiscard]] Result<Image> to_grey(std::span<const std::uint8_t> bytes, const RawLayout& layout);

}  // namespace waymark
