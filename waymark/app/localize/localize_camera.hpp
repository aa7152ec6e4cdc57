#pragma once

#include <functional>
#include <string>

#include "waymark/app/common/camera_moment.hpp"
#include "waymark/app/live/camera_watch.hpp"
#include "waymark/app/localize/localize_log.hpp"
#include "waymark/camera/camera_model.hpp"

/// `waymark localize` of a camera without a robot, in a hand or on a stand.
namespace waymark {

class LiveFeed;

struct LocalizeCameraJob {
  LocalizeJob localize{};  ///< map, output; else nothing of it
  CameraModel camera;
  std::string images{};   ///< how pictures are recorded: raw, jpeg; empty: not at all
  double duration_s = 0;  ///< 0: until the control cancels it
  LiveFeed* feed = nullptr;
  std::function<void(const CameraMoment&)> on_moment = [](const CameraMoment&) {};  ///< of every picture
};

struct LocalizeCameraReport {
  CameraWatchEnd end{};
  std::size_t known = 0;  ///< pictures with a pose
};

/// Localises an opened camera until it ends, the time is over, or the control cancels it. A recording holds
/// tags and poses (/waymark/pose) with stamps since 1970.
[[nodiscard]] Result<LocalizeCameraReport> localize_camera(LiveCamera& camera, const LocalizeCameraJob& job,
                                                           const JobControl& control);

}  // namespace waymark
