#pragma once

#include <functional>

#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/localize/camera_moment.hpp"
#include "waymark/app/localize/localize_log.hpp"

/// `waymark localize walk.mp4`: where a camera that is carried by hand was, by a map of the tags it saw.
namespace waymark {

struct LocalizeVideoJob {
  LocalizeJob localize{};  ///< map, tag size, output, one video as log; else nothing of it
  CameraModel camera;
  double readout_s = 0;  ///< of a rolling shutter, as camera_moments()
  std::function<void(const CameraMoment&)> on_moment = [](const CameraMoment&) {};  ///< of every picture
};

struct LocalizeVideoReport {
  VideoTags video{};
  std::size_t known = 0;       ///< pictures with a pose
  double corner_error_px = 0;  ///< CameraMoments::corner_error_px
};

/// Finds the tags of every picture, and then the poses. The output appears whole or not at all; a recording
/// holds the tags, the poses (/waymark/pose) and the camera, with stamps since the first picture.
[[nodiscard]] Result<LocalizeVideoReport> localize_video(const LocalizeVideoJob& job,
                                                         const JobControl& control);

}  // namespace waymark
