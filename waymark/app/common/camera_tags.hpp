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

/// What became of a video.
struct VideoTags {
  VideoInfo info{};
  std::size_t pictures = 0;
  std::size_t tags = 0;
  std::vector<VideoProblem> problems{};
};

/// Called with each picture and its tags, in order; the view is valid during the call.
using EachVideoTags = std::function<Status(const VideoFrame& picture, TagFrame& tags)>;

/// Finds the tags of every picture, with the bent edges of `camera` where it is given; its size must be that
/// of the pictures. Fails when the video cannot be opened, when `each` fails, and when it is cancelled.
[[nodiscard]] Result<VideoTags> find_video_tags(const std::string& path, const TagFinder& finder,
                                                const CameraModel* camera, const JobControl& control,
                                                const EachVideoTags& each);

/// `waymark convert walk.mp4 lap.mcap`: the tags of a video, or of a live camera, as a recording.
struct ConvertVideoJob {
  std::string input{};
  std::string output{};  ///< new file
  std::optional<CameraModel>
      camera{};            ///< written as /camera_info, at the origin of the base and straight ahead
  TagSizes sizes{};        ///< noted in the recording
  std::string pictures{};  ///< kept as: raw, jpeg; empty: not at all
};

/// Takes a picture and its tags, in order; the view is valid during the call.
using TakeTagPicture = std::function<Status(const ImageView& picture, const TagFrame& tags)>;

/// Writes the pictures that `all` gives, and their tags, to the job's output, which appears when `all` ends
/// well. `format`: of the input, noted in the recording. Errors: as convert_video().
[[nodiscard]] Status record_tags(const ConvertVideoJob& job, const std::string& format,
                                 const std::function<Status(const TakeTagPicture&)>& all);

/// The output appears when it is whole. InvalidArgument: the job makes no sense; any other code: a file.
[[nodiscard]] Result<VideoTags> convert_video(const ConvertVideoJob& job, const TagFinder& finder,
                                              const JobControl& control);
[[nodiscard]] std::string to_text(const ConvertVideoJob& job, const VideoTags& found);

/// What `waymark convert` reports of a video.
struct ConvertedVideo {
  std::string input{};
  std::string output{};
  VideoTags found{};
};
[[nodiscard]] ReportFields fields(const ConvertedVideo& converted);

// What a camera without a robot saw: a video, or the recording of a live camera.

/// Whether a file is of a camera without a robot: a video. Where somebody gives the camera's calibration,
/// also a recording that holds tags or pictures and neither odometry nor an IMU; and whatever cannot be read,
/// or holds nothing, so that whoever opens it says so.
[[nodiscard]] bool is_of_camera(const std::string& path, bool calibrated);

/// Fails on the recording of a robot, where a camera is asked for: not is_of_camera(). `hint`: who takes it.
[[nodiscard]] Status check_of_camera(const std::string& path, const std::string& hint);

/// Called with the tags of each picture, in order.
using EachTagFrame = std::function<Status(TagFrame& tags)>;

/// The tags of every picture of a video, or of such a recording: those that it holds, else those of its
/// pictures, with the bent edges of `camera`. Errors: as find_video_tags(); a recording of several
/// cameras.
[[nodiscard]] Result<VideoTags> find_camera_tags(const std::string& path, const TagFinder& finder,
                                                 const CameraModel& camera, const JobControl& control,
                                                 const EachTagFrame& each);

}  // namespace waymark
