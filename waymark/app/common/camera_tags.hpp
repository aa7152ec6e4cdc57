#pragma once

#include <functional>
#include <string>

#include "waymark/app/common/convert_video.hpp"

/// What a camera without a robot saw: a video, or the recording of a live camera.
namespace waymark {

/// Whether a file is of a camera without a robot: a video. Where somebody gives the camera's calibration,
/// also a recording that holds tags or pictures and neither odometry nor an IMU; and whatever cannot be read,
/// or holds nothing, so that whoever opens it says so.
[[nodiscard]] bool is_of_camera(const std::string& path, bool calibrated);

/// Called with the tags of each picture, in order.
using EachTagFrame = std::function<Status(TagFrame& tags)>;

/// The tags of every picture of a video, or of such a recording: those that it holds, else those of its
/// pictures, with the bent edges of `camera`. Errors: as find_video_tags(); a recording of several
/// cameras.
[[nodiscard]] Result<VideoTags> find_camera_tags(const std::string& path, const TagFinder& finder,
                                                 const CameraModel& camera, const JobControl& control,
                                                 const EachTagFrame& each);

}  // namespace waymark
