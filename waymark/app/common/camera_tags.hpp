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

/// Reads videos as streams of tags, for recordings and maps.
namespace waymark {

/// Result of detecting tags in a video.
struct VideoTags {
  VideoInfo info{};
  std::size_t images = 0;
  std::size_t tags = 0;
  std::size_t unreliable = 0;  ///< number of these tags with unreliable corners
  std::vector<VideoProblem> problems{};
};

/// Called with each image and its tags, in order; the view is valid only during the call.
using EachVideoTags = std::function<Status(const VideoFrame& image, TagFrame& tags)>;

/// Detects the tags in every image; if the lens is known, the images must have the size of its camera.
/// Fails if the video cannot be opened, if `each` fails, or if the job is cancelled.
[[nodiscard]] Result<VideoTags> find_video_tags(const std::string& path, const TagFinder& finder,
                                                ImageLens lens, const JobControl& control,
                                                const EachVideoTags& each);

/// `waymark convert walk.mp4 lap.mcap`: writes the tags detected in a video, or by a live camera, to a
/// recording.
struct ConvertVideoJob {
  std::string input{};
  std::string output{};                 ///< path of the output, which must not exist yet
  std::optional<CameraModel> camera{};  ///< written to /camera_info; the camera is mounted at the origin of
                                        ///< the base and looks straight ahead
  TagSizes sizes{};                     ///< tag sizes to be stored in the recording
  std::string images{};  ///< format of the recorded images, raw or jpeg; they are not recorded if empty
};

/// Receives an image and its tags, in order; the view is valid only during the call.
using TakeTagImage = std::function<Status(const ImageView& image, const TagFrame& tags)>;

/// Writes the images that `all` passes on, and their tags, to the output of the job. The output file appears
/// only if `all` succeeds. `format` is the format of the input and is stored in the recording. Errors are
/// those of convert_video().
[[nodiscard]] Status record_tags(const ConvertVideoJob& job, const std::string& format,
                                 const std::function<Status(const TakeTagImage&)>& all);

/// The output appears only when it is complete. Errors: InvalidArgument if the job is invalid; other codes
/// refer to a file.
[[nodiscard]] Result<VideoTags> convert_video(const ConvertVideoJob& job, const TagFinder& finder,
                                              const JobControl& control);
[[nodiscard]] std::string to_text(const ConvertVideoJob& job, const VideoTags& found);

/// Report of `waymark convert` for a video.
struct ConvertedVideo {
  std::string input{};
  std::string output{};
  VideoTags found{};
};
[[nodiscard]] ReportFields fields(const ConvertedVideo& converted);

// Data from a camera without a robot: a video, or a recording of a live camera.

/// Whether a file is from a camera without a robot. This is true for videos and, if the caller provides a
/// camera calibration, for recordings that contain tags or images but neither odometry nor IMU data. It is
/// also true for unreadable and empty files, so that their reader reports the error.
[[nodiscard]] bool is_of_camera(const std::string& path, bool calibrated);

/// Fails if is_of_camera() is false, that is, for the recording of a robot. `hint` names the verb that
/// accepts such a file.
[[nodiscard]] Status check_of_camera(const std::string& path, const std::string& hint);

/// Called with the tags of each image, in order.
using EachTagFrame = std::function<Status(TagFrame& tags)>;

/// The tags in every image of a video or of such a recording. Recorded tags are used if there are any;
/// otherwise tags are detected in the images, using the lens model of `camera`. Fails as find_video_tags()
/// does, and on recordings from several cameras.
[[nodiscard]] Result<VideoTags> find_camera_tags(const std::string& path, const TagFinder& finder,
                                                 const CameraModel& camera, const JobControl& control,
                                                 const EachTagFrame& each);

}  // namespace waymark
