#pragma once
// Internal to the room: PNG using libpng.

#include "waymark/codecs/formats.hpp"

namespace waymark::codecs {

[[nodiscard]] Result<ImageInfo> probe_png(const Input& input);
[[nodiscard]] Result<Image> decode_png(const Input& input, const DecodeOptions& options);
[[nodiscard]] Bytes encode_png(const Pixels& pixels);

}  // namespace waymark::codecs
