#pragma once

#include <cstdint>

#include "waymark/app/common/job_control.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {

struct Ros2PlayOptions {
  double speed = 1;  ///< playback rate; 0 means without waiting
  /// Whether to publish velocity commands as well, which move a robot that subscribes to them.
  bool commands = false;
};

struct Ros2Played {
  Status status{};
  std::uint64_t published = 0;  ///< number of messages published; also valid after a failure
};

/// Publishes the selected part of a recording on ROS 2, which is configured by environment variables. Each
/// message is published when it is due. Notes report omitted topics and topics without subscribers. Fails if
/// another program publishes on one of the topics.
[[nodiscard]] Ros2Played play_to_ros2(MessageLog& log, const LogSelection& selection,
                                      const Ros2PlayOptions& options, const JobControl& control);

}  // namespace waymark
