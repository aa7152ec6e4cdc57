#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "waymark/base/error.hpp"
#include "waymark/codecs/image_codec.hpp"

namespace waymark {

/// Quality of JPEG files written without a stated one: edges of tags move by less than the noise of a camera.
inline constexpr int kJpegFileQuality = 95;

/// Reads a picture from a file, as decode_image does. Errors: NotFound, Unreadable (a folder, no permission,
/// a bad picture), Unsupported, LimitExceeded.
[[nodiscard]] Result<Image> read_image(const std::filesystem::path& path, const DecodeOptions& options = {});

/// Reads the header of a picture file, as probe does.
[[nodiscard]] Result<ImageInfo> probe_image(const std::filesystem::path& path);

/// Writes a picture; the format follows the suffix: .png, .jpg or .jpeg (kJpegFileQuality), .pgm, .ppm or
/// .pnm, any case. Errors: InvalidArgument (empty picture, unknown suffix; colour into .pgm), Unwritable
/// (folder missing, no permission, disk full). A file that could not be completed is removed.
[[nodiscard]] Status write_image(const std::filesystem::path& path, const ImageView& image);
[[nodiscard]] Status write_image(const std::filesystem::path& path, const ColorImage& image);

/// Writes all bytes and makes sure the system took them (a full disk shows when the file is closed). Errors:
/// Unwritable.
[[nodiscard]] Status write_bytes(const std::filesystem::path& path, std::span<const std::uint8_t> bytes);

}  // namespace waymark
