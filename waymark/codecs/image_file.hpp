#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "waymark/base/error.hpp"
#include "waymark/codecs/image_codec.hpp"

namespace waymark {

/// Default quality of JPEG files. It shifts tag edges by less than camera noise does.
inline constexpr int kJpegFileQuality = 95;

/// Reads an image from a file, like decode_image(). Errors: NotFound, Unreadable (a folder, no permission, an
/// invalid image), Unsupported, LimitExceeded.
[[nodiscard]] Result<Image> read_image(const std::filesystem::path& path, const DecodeOptions& options = {});

/// Reads the header of an image file, like probe().
[[nodiscard]] Result<ImageInfo> probe_image(const std::filesystem::path& path);

/// Writes an image in the format given by the file extension (case-insensitive): .png, .jpg or .jpeg
/// (kJpegFileQuality), .pgm, .ppm or .pnm. Errors: InvalidArgument (empty image, unknown extension, colour
/// image in a .pgm), Unwritable (missing folder, no permission, full disk). An incomplete file is removed.
[[nodiscard]] Status write_image(const std::filesystem::path& path, const ImageView& image);
[[nodiscard]] Status write_image(const std::filesystem::path& path, const ColorImage& image);

/// Writes all bytes and checks that the system accepted them (a full disk may be reported only when the file
/// is closed). Errors: Unwritable.
[[nodiscard]] Status write_bytes(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);

}  // namespace waymark
