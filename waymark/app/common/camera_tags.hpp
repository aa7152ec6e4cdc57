#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/media/video_reader.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_sizes.hpp"
#include "waymark/tags/tag_finder.hpp"

/// Videos as streams of tags: for recordings, and for maps.
namespace waymark {

/// Result of detection in a video.
struct VideoTags {
  VideoInfo info{};
  std::size_t pictures = 0;
  std::size_t tags = 0;
  std::vector<VideoProblem> problems{};
};

/// Called with each image and its tags, in order; the view is valid during the call.
using EachVideoTags = std::function<Status(const VideoFrame& picture, TagFrame& tags)>;

/// Detects the tags in every image, with the lens model of `camera` if given; its size must be that
/// of the images. Fails if the video cannot be opened, if `each` fails, and on cancellation.
[[nodiscard]] Result<VideoTags> find_video_tags(const std::string& path, const TagFinder& finder,
                                                const CameraModel* camera, const JobControl& control,
                                                const EachVideoTags& each);

/// `waymark convert walk.mp4 lap.mcap`: writes the tags of a video, or of a live camera, as a recording.
struct ConvertVideoJob {
  std::string input{};
  std::string output{};  ///< new file
  std::optional<CameraModel>
      camera{};            ///< written as /camera_info, at the origin of the base and straight ahead
  TagSizes sizes{};        ///< stored in the recording
  std::string pictures{};  ///< recorded as raw or jpeg; empty: not recorded
};

/// Receives an image and its tags, in order; the view is valid during the call.
using TakeTagPicture = std::function<Status(const ImageView& picture, const TagFrame& tags)>;

/// Writes the images passed by `all`, and their tags, to the job's output, which appears if `all`
/// succeeds. `format`: of the input, stored in the recording. Errors: as convert_video().
[[nodiscard]] Status record_tags(const ConvertVideoJob& job, const std::string& format,
                                 const std::function<Status(const TakeTagPicture&)>& all);

/// The output appears only when it is complete. Errors: InvalidArgument for an invalid job; other codes
/// concern a file.
[[nodiscard]] Result<VideoTags> convert_video(const ConvertVideoJob& job, const TagFinder& finder,
                                              const JobControl& control);
[[nodiscard]] std::string to_text(const ConvertVideoJob& job, const VideoTags& found);

/// Report of `waymark convert` on a video.
struct ConvertedVideo {
  std::string input{};
  std::string output{};
  VideoTags found{};
};
[[nodiscard]] ReportFields fields(const ConvertedVideo& converted);

// Data of a camera without a robot: a video, or the recording of a live camera.

/// Whether a file is of a camera without a robot. This is true of videos and, if the caller sets a camera
/// calibration, of recordings with tags or images and neither odometry nor an IMU. It is also true of
/// unreadable and empty files, so that their reader reports the error.
[[nodiscard]] bool is_of_camera(const std::string& path, bool calibrated);

/// Fails unless is_of_camera(), that is, for the recording of a robot. `hint` names the verb that accepts it.
[[nodiscard]] Status check_of_camera(const std::string& path, const std::string& hint);

/// Called with the tags of each image, in order.
using EachTagFrame = std::function<Status(TagFrame& tags)>;

/// The tags of every image of a video or of such a recording: recorded tags, else those detected in its
/// images with the lens model of `camera`. Errors: as find_video_tags(); a recording of several
/// cameras.
[[nodiscard]] Result<VideoTags> find_camera_tags(const std::string& path, const TagFinder& finder,
                                                 const CameraModel& camera, const JobControl& control,
                                                 const EachTagFrame& each);

}  // namespace waymark
