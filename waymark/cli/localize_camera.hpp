#pragma once

#include "waymark/cli/localize_live.hpp"

namespace waymark::cli {

/// `waymark localize v4l2:… --camera FILE --map FILE`: where a camera without a robot is, until Ctrl-C.
[[nodiscard]] ExitCode localize_a_camera(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                                         Console& console);

}  // namespace waymark::cli
