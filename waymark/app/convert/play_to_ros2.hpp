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

/// Publishes the selected part of a recording on ROS 2 (configured by the environment), each message
/// when it is due, with notes on omitted topics and topics without subscribers. Fails if another program
/// publishes one of the topics.
[[nodiscard]] Ros2Played play_to_ros2(MessageLog& log, const LogSelection& selection,
                                      const Ros2PlayOptions& options, const JobControl& control);

}  // namespace waymark
