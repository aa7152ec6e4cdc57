#pragma once
// Internal to the room: PNM without a library.

#include "waymark/codecs/formats.hpp"

namespace waymark::codecs {

[[nodiscard]] Result<ImageInfo> probe_pnm(const Input& input);
[[nodiscard]] Result<Image> decode_pnm(const Input& input, const DecodeOptions& options);
[[nodiscard]] Bytes encode_pnm(const Pixels& pixels);

}  // namespace waymark::codecs
