#pragma once

#include <cstdint>

#include "waymark/app/common/job_control.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {

struct Ros2PlayOptions {
  double speed = 1;       ///< as recorded; 0: without waiting
  bool commands = false;  ///< also velocity commands, which move a robot that listens
};

struct Ros2Played {
  Status status{};
  std::uint64_t published = 0;  ///< messages, also where it failed
};

/// Publishes what is selected of a recording on the network of ROS 2 that the environment names, each message
/// when it is due, and notes what was left out and what nobody gets. Fails where another program publishes
/// one of the topics.
[[nodiscard]] Ros2Played play_to_ros2(MessageLog& log, const LogSelection& selection,
                                      const Ros2PlayOptions& options, const JobControl& control);

}  // namespace waymark
