#pragma once

#ifdef WAYMARK_HAVE_LIBAV

#include "waymark/image/image.hpp"
#include "waymark/media/libav.hpp"

namespace waymark::internal {

/// The luma of a decoded picture: its own plane where that has eight bits and rows in order, else converted
/// into `storage` (deeper samples rounded down to eight bits, packed ones taken apart, RGB by Rec. 601).
/// Unsupported: palettes, Bayer patterns, floating point, pictures in the memory of a graphics card.
[[nodiscard]] Result<ImageView> luma_of(const Libav& av, const AVFrame& frame, Image& storage);

}  // namespace waymark::internal

#endif
