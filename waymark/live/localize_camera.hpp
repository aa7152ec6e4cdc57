#pragma once

#include <functional>
#include <optional>
#include <string>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/jobs/localize_log.hpp"
#include "waymark/live/camera_watch.hpp"

/// `waymark localize` of a camera without a robot, in a hand or on a stand.
namespace waymark {

class LiveFeed;

/// Where a camera was by the tags of one picture. Its body has x forward, y left, z up (body_R_optical()).
struct CameraMoment {
  SensorTime stamp{};  ///< since 1970
  Duration age{};      ///< CameraPicture::age
  int tags = 0;        ///< of the map, that the pose rests on; without a pose: that were found
  /// Nothing where no tag of the map was found, or the picture does not tell which of two poses is true.
  std::optional<Uncertain<SE3>> map_T_body{};
};

/// The pose by the tags of one picture, in six degrees of freedom.
[[nodiscard]] CameraMoment camera_moment(const TagFrame& frame, const TagMap& map, const CameraModel& camera);

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
