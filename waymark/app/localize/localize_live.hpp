#pragma once

#include <functional>
#include <string>

#include "waymark/app/localize/localize_camera.hpp"
#include "waymark/app/localize/localize_kind.hpp"
#include "waymark/app/localize/localize_robot.hpp"
#include "waymark/app/localize/localize_video.hpp"

/// What is localised instead of a recording, as a user says it.
namespace waymark {

/// Lines about where it is.
struct LocalizeLines {
  bool json = false;
  std::function<void(const std::string&)> print;
};

[[nodiscard]] LocalizeRobotJob described_robot(const LocalizeLive& words, const LocalizeJob& job,
                                               const LocalizeLines& lines);
/// Both fail without a calibration, and where it cannot be read.
[[nodiscard]] Result<LocalizeCameraJob> described_live_camera(const LocalizeLive& words,
                                                              const LocalizeJob& job,
                                                              const LocalizeLines& lines);
[[nodiscard]] Result<LocalizeVideoJob> described_video(const LocalizeLive& words, const LocalizeJob& job,
                                                       const LocalizeLines& lines);

/// "812 pictures in 27.0 s, the place known in 640"
[[nodiscard]] std::string to_text(const LocalizeCameraReport& report);
[[nodiscard]] std::string to_text(const LocalizeVideoReport& report);

}  // namespace waymark
