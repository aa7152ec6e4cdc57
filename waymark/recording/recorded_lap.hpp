#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "waymark/recording/message_log.hpp"
#include "waymark/recording/recording_setup.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// A whole recording in memory: what making a map of a lap needs.
struct RecordedLap {
  RecordingSetup setup{};
  std::vector<TagFrame> frames{};
  std::vector<Odometry> odometry{};
  std::vector<TagPoseFrame> tag_poses{};  ///< of a robot that keeps no corners
  std::vector<ImuSample> imu{};
  Trajectory truth{};                                ///< empty when nobody knew it
  std::map<std::string, std::string> attachments{};  ///< their bytes, by name
  std::vector<std::string> notes{};                  ///< what was put in order or left out, in words
};

/// Puts pictures that were recorded up to a second out of order in the order of their stamps, and leaves out
/// those that have the stamp of another of the same camera; what was done stands among the notes. A clock
/// that went back by more is left as it is: what came before and after it has no order.
void order_frames(RecordedLap& lap);

/// Odometry that was set back on the way (odometry_jumped()) goes on from where it was, as if the robot had
/// stood meanwhile; a note says so.
void rejoin_odometry(RecordedLap& lap);

/// Finds the tags of a picture, where a recording holds pictures only.
using FrameFinder = std::function<Result<TagFrame>(const CameraFrame& frame, const CameraModel* camera)>;

enum class TagSource : std::uint8_t {
  AsRecorded,  ///< the tags it holds; its pictures only where it holds none
  Pictures,    ///< its pictures, whatever tags it holds
};

/// Reads all of it, whatever its format; of several cameras the one that `choice` names. Pictures are looked
/// at only when `find` is given. What is damaged is passed over, and `setup.problems` says so. Fails when
/// `find` does, or when there are no pictures to look at though they were asked for.
[[nodiscard]] Result<RecordedLap> read_lap(MessageLog& log, const FrameFinder& find = {},
                                           TagSource source = TagSource::AsRecorded,
                                           const CameraChoice& choice = {});

}  // namespace waymark
