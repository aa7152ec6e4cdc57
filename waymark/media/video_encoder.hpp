#pragma once

#ifdef WAYMARK_HAVE_LIBAV

#include <string>

#include "waymark/media/libav.hpp"
#include "waymark/media/video_writer.hpp"

namespace waymark::internal {

/// How the pictures are encoded: the first encoder for this codec that is installed, opened.
/// `needs_global_header` and
/// `may_reorder` (pictures predicted from later ones) as the container wants it.
[[nodiscard]] Result<LibavPtr<AVCodecContext>> open_encoder(const Libav& av, VideoCodec codec, int width_px,
                                                            int height_px, AVRational time_base,
                                                            bool needs_global_header, bool may_reorder,
                                                            const VideoWriterOptions& options);

}  // namespace waymark::internal

#endif
