#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/robots/dds/bus.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A velocity command as CDR: geometry_msgs/msg/TwistStamped, or Twist, which has no stamp.
[[nodiscard]] std::vector<std::uint8_t> velocity_message(const StampedCommand& command, bool stamped);

/// The same with the time of this computer's clock as its stamp.
[[nodiscard]] std::vector<std::uint8_t> velocity_message_now(const VelocityCommand& command, bool stamped);

/// Publishes zero several times, 80 ms in all: a network that is left right after a message may never send
/// it.
[[nodiscard]] Status publish_zero(Bus& bus, std::size_t publisher, bool stamped);

}  // namespace waymark
