#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/camera/image_lens.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/recording_setup.hpp"
#include "waymark/samples/clock_check.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// A whole recording in memory, as needed to map a lap.
struct RecordedLap {
  RecordingSetup setup{};
  std::vector<TagFrame> frames{};
  std::vector<Odometry> odometry{};
  std::vector<TagPoseFrame> tag_poses{};  ///< from robots that do not record corners
  std::vector<ImuSample> imu{};
  Trajectory truth{};                                ///< empty if unknown
  std::map<std::string, std::string> attachments{};  ///< contents by name
  std::vector<std::string> notes{};  ///< report images and odometry that were reordered or skipped
  /// Why odometry, IMU data or ground truth are not in the lap although they were recorded: they are stamped
  /// by another clock than the images. Its error is one of `setup.problems` as well.
  std::optional<OtherClock> other_clock{};
};

/// Removes odometry, IMU data and ground truth that do not overlap the images in time (ClockCheck), and sets
/// `other_clock`.
void remove_other_clocks(RecordedLap& lap);

/// Sorts images by their stamps if they were recorded up to one second out of order. Removes images with the
/// same stamp as another image from the same camera. Both are noted. After a larger backward jump of the
/// clock, images are not sorted, because those before and after the jump cannot be ordered.
void order_frames(RecordedLap& lap);

/// Recorded tags without a family were read as tag36h11. If an id does not exist in it, all tags of tag36h11
/// get the family usual_family() instead, which is noted.
void name_family(RecordedLap& lap);

/// Removes resets of the odometry (odometry_jumped()): it continues from the pose before the reset, as if the
/// robot had been stationary in the meantime. Each reset is noted.
void rejoin_odometry(RecordedLap& lap);

/// Detects the tags in an image, for recordings that contain no detections.
using FrameFinder = std::function<Result<TagFrame>(const CameraFrame& frame, ImageLens lens)>;

enum class TagSource : std::uint8_t {
  AsRecorded,  ///< recorded tags; images only if there are no recorded tags
  Images,      ///< images, even if tags were recorded
};

/// Reads a whole recording of any format; `choice` selects one of several cameras. Images are read only if
/// `find` is given. Damaged data are skipped and reported in `setup.problems`. Fails if `find` fails, or if
/// images were requested and there are none.
[[nodiscard]] Result<RecordedLap> read_lap(MessageLog& log, const FrameFinder& find = {},
                                           TagSource source = TagSource::AsRecorded,
                                           const CameraChoice& choice = {});

}  // namespace waymark
