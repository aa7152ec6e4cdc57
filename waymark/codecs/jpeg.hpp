#pragma once
// Internal to the room: JPEG using libjpeg-turbo.

#include "waymark/codecs/formats.hpp"

namespace waymark::codecs {

[[nodiscard]] Result<ImageInfo> probe_jpeg(const Input& input);
[[nodiscard]] Result<Image> decode_jpeg(const Input& input, const DecodeOptions& options);
[[nodiscard]] Bytes encode_jpeg(const Pixels& pixels, int quality);

}  // namespace waymark::codecs
