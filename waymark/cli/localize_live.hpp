#pragma once

#include <string>
#include <vector>

#include "waymark/cli/console.hpp"
#include "waymark/cli/page_flags.hpp"
#include "waymark/jobs/localize_log.hpp"

namespace CLI {
class App;
}

namespace waymark::cli {

/// The flags of `waymark localize` for a robot or a camera that is there, instead of a recording. Must stay
/// where they are while the command line is parsed.
struct LocalizeLiveFlags {
  std::string robot_file{};
  std::vector<std::string> camera_sources{};
  std::string camera{};  ///< calibration of a camera without a robot
  std::string images{};
  double duration_s = 0;  ///< 0: until somebody ends it
  double every_s = 1;
  LiveFlags view{};

  void add_to(CLI::App& app);
};

/// Whether the job is about a robot or a camera that is there. Fails on flags that do not go with what it is.
[[nodiscard]] Result<bool> is_live(const CLI::App& app, const LocalizeJob& job);

/// `waymark localize --robot KIND:ADDRESS` and `waymark localize v4l2:…`, until Ctrl-C.
[[nodiscard]] ExitCode localize_live(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                                     Console& console);

}  // namespace waymark::cli
