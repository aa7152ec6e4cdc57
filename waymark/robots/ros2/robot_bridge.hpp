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

/// Converts the messages from a robot with ROS 2 to the lines of a robot process
/// (docs/formats/robot-process.md), and commands to messages. Messages are dropped, counted and reported if
/// they cannot be decoded, contain non-finite numbers or have a misleading timestamp. Pure.
class RobotBridge {
 public:
  /// Without `put_image`, the lines contain the images as base64.
  RobotBridge(Ros2Profile profile, RobotDescription robot, PutImage put_image = {});

  /// The lines for a message in CDR with its encapsulation header; empty if it is dropped or merely stored.
  [[nodiscard]] std::vector<std::string> receive(const Ros2Subscription& from,
                                                 std::span<const std::uint8_t> bytes, Duration arrived);
  /// The reports for the user since the last call, as log lines.
  [[nodiscard]] std::vector<std::string> take_reports() { return lines_.take_reports(); }
  /// Number of dropped messages.
  [[nodiscard]] std::uint64_t dropped() const { return lines_.dropped(); }
  /// Whether odometry has been received.
  [[nodiscard]] bool speaks() const { return lines_.speaks(); }
  /// The simulation clock if the profile sets use_sim_time; `nullopt` before its first message.
  [[nodiscard]] std::optional<SensorTime> simulated_time() const { return simulated_time_; }
  /// SampleLines::offset().
  [[nodiscard]] std::optional<Duration> offset() const { return lines_.offset(); }

  /// The message for a command; `now` is the timestamp of a TwistStamped.
  [[nodiscard]] std::vector<std::uint8_t> command(const VelocityCommand& command, SensorTime now) const;

 private:
  Result<std::vector<std::string>> lines_of(const Ros2Subscription& from, std::span<const std::uint8_t> bytes,
                                            Duration arrived);
  Result<std::string> compressed_image(const Ros2Subscription& from, std::span<const std::uint8_t> bytes,
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
  std::string base_frame_;  ///< empty if not yet known
  std::optional<SensorTime> simulated_time_{};
  std::string camera_frame_{};
  std::map<std::string, SO3> base_R_imu_{};  ///< by frame
};

}  // namespace waymark
