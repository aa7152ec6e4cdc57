#pragma once

#include <string>
#include <vector>

#include "waymark/cli/console.hpp"
#include "waymark/jobs/localize_log.hpp"
#include "waymark/live/live_page.hpp"
#include "waymark/live/localize_kind.hpp"

namespace waymark::cli {

/// What is said of a robot, a camera or a video, and who watches.
struct LocalizeLiveFlags : LocalizeLive {
  ViewerOptions view{};
};

/// Prints the report and what is doubtful about it; its exit code.
[[nodiscard]] ExitCode show_localized(const LocalizeReport& report, const LocalizeJob& job, bool json,
                                      const std::vector<std::string>& warnings, Console& console);

/// `waymark localize --robot KIND:ADDRESS`, until Ctrl-C.
[[nodiscard]] ExitCode localize_a_robot(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                                        Console& console);
/// `waymark localize v4l2:…`, until Ctrl-C.
[[nodiscard]] ExitCode localize_a_camera(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                                         Console& console);
/// `waymark localize walk.mp4`.
[[nodiscard]] ExitCode localize_a_video(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                                        Console& console);

}  // namespace waymark::cli
