#pragma once

#include <cstdint>

#include "waymark/app/common/job_control.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {

struct Ros2PlayOptions {
  double speed = 1;       ///< playback rate; 0: without waiting
  bool commands = false;  ///< also publish velocity commands, which move a subscribed robot
};

struct Ros2Played {
  Status status{};
  std::uint64_t published = 0;  ///< number of messages, also after a failure
};

/// Publishes the selected part of a recording on ROS 2, configured by the environment variables. Each message
/// is published when it is due. Notes report omitted topics and topics without subscribers. Fails if another
/// program publishes one of the topics.
[[nodiscard]] Ros2Played play_to_ros2(MessageLog& log, const LogSelection& selection,
                                      const Ros2PlayOptions& options, const JobControl& control);

}  // namespace waymark
