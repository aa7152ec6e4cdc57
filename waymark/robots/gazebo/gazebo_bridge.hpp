#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/robots/gazebo/gazebo_link.hpp"
#include "waymark/robots/gazebo/profile.hpp"
#include "waymark/robots/wire/sample_lines.hpp"

namespace waymark {

/// Converts the messages from a robot in Gazebo to the lines of a robot process
/// (docs/formats/robot-process.md). Messages are dropped, counted and reported if they are unreadable or have
/// the wrong type or a misleading timestamp. Timestamps are compared with simulated time, so the simulation
/// may run slower than real time. Pure.
class GazeboBridge {
 public:
  GazeboBridge(const GazeboProfile& profile, RobotDescription robot, PutImage put_image = {});

  /// The lines for a message; empty if it is dropped or merely stored.
  [[nodiscard]] std::vector<std::string> receive(const GazeboSubscription& from,
                                                 const GazeboMessage& message);
  /// The reports for the user since the last call, as log lines.
  [[nodiscard]] std::vector<std::string> take_reports() { return lines_.take_reports(); }
  [[nodiscard]] std::uint64_t dropped() const { return lines_.dropped(); }
  /// Whether odometry has been received.
  [[nodiscard]] bool speaks() const { return lines_.speaks(); }
  /// The newest simulated time from odometry; `nullopt` before the first message.
  [[nodiscard]] std::optional<SensorTime> simulated_time() const { return simulated_time_; }

 private:
  Result<std::vector<std::string>> lines_of(const GazeboSubscription& from, const GazeboMessage& message);
  Result<std::vector<std::string>> truth(const GazeboSubscription& from, const GazeboPoses& poses);
  Result<std::vector<std::string>> line_of(const GazeboSubscription& from, Sample sample);

  RobotDescription robot_;
  std::string truth_model_;
  SampleLines lines_;
  std::optional<SensorTime> simulated_time_{};
};

}  // namespace waymark
