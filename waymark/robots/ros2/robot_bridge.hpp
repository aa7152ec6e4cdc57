#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/recording/ros2/frame_tree.hpp"
#include "waymark/robots/ros2/profile.hpp"
#include "waymark/robots/wire/sample_lines.hpp"

namespace waymark {

/// Turns the messages of a robot that speaks ROS 2 into the lines of a robot process
/// (docs/formats/robot-process.md), and commands into messages. What cannot be decoded, has numbers that are
/// none, or a stamp that misleads is dropped, counted, and named in words. Pure.
class RobotBridge {
 public:
  /// Without `put_picture` pictures stand in the lines themselves.
  RobotBridge(Ros2Profile profile, RobotDescription robot, PutPicture put_picture = {});

  /// The lines of a message in CDR with its encapsulation; empty for one that is dropped or only kept here.
  [[nodiscard]] std::vector<std::string> receive(const Ros2Subscription& from,
                                                 std::span<const std::uint8_t> bytes, Duration arrived);
  /// What people should know, since the last call: as lines, too.
  [[nodiscard]] std::vector<std::string> take_words() { return lines_.take_words(); }
  /// Messages that were dropped.
  [[nodiscard]] std::uint64_t dropped() const { return lines_.dropped(); }
  /// Whether odometry came.
  [[nodiscard]] bool speaks() const { return lines_.speaks(); }
  /// The clock of a simulation, where the profile says that time is its; nothing before it came.
  [[nodiscard]] std::optional<SensorTime> simulated_time() const { return simulated_time_; }
  /// SampleLines::offset().
  [[nodiscard]] std::optional<Duration> offset() const { return lines_.offset(); }

  /// The message of a command; `now`: the stamp of a TwistStamped.
  [[nodiscard]] std::vector<std::uint8_t> command(const VelocityCommand& command, SensorTime now) const;

 private:
  Result<std::vector<std::string>> lines_of(const Ros2Subscription& from, std::span<const std::uint8_t> bytes,
                                            Duration arrived);
  Result<std::string> compressed_picture(const Ros2Subscription& from, std::span<const std::uint8_t> bytes,
                                         Duration arrived);
  void learn_base(std::span<const std::uint8_t> bytes);
  void turn_imu(ImuSample& imu, std::span<const std::uint8_t> bytes);
  Status keep_clock(std::span<const std::uint8_t> bytes);
  Status keep_transforms(std::span<const std::uint8_t> bytes);
  Status compare_camera(std::span<const std::uint8_t> bytes);
  void compare_mounting();

  Ros2Profile profile_;
  RobotDescription robot_;
  SampleLines lines_;
  FrameTree frames_{};
  std::string base_frame_;  ///< empty: not known yet
  std::optional<SensorTime> simulated_time_{};
  std::string camera_frame_{};
  std::map<std::string, SO3> base_R_imu_{};  ///< by frame
};

}  // namespace waymark
