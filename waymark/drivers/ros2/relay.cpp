#include "waymark/drivers/ros2/relay.hpp"

#include <optional>

#include <fmt/format.h>

#include "waymark/drivers/dds/ros_names.hpp"
#include "waymark/drivers/ros2/velocity_message.hpp"
#include "waymark/drivers/watchdog/pipes.hpp"
#include "waymark/recording/cdr.hpp"
#include "waymark/recording/ros2_convert.hpp"

namespace waymark {
namespace {

Result<VelocityCommand> decode_command(bool stamped, std::span<const std::uint8_t> bytes) {
  ros2::TwistStamped message;
  if (stamped) {
    auto decoded = cdr::decode<ros2::TwistStamped>(bytes);
    if (!decoded) return tl::unexpected(decoded.error());
    message = *decoded;
  } else {
    auto decoded = cdr::decode<ros2::Twist>(bytes);
    if (!decoded) return tl::unexpected(decoded.error());
    message.twist = *decoded;
  }
  return ros2::from_ros(message).command;
}

}  // namespace

std::string words_of(const RelayOptions& options, int domain) {
  return fmt::format(
      "commands are passed on from {} to {} ({}) in domain {}, until Ctrl-C; zero where none came for {:g} s",
      options.from, options.to, options.stamped ? "TwistStamped" : "Twist", domain,
      to_seconds(options.repeat.timeout));
}

std::string words_of(const RelayCounts& counts) {
  return fmt::format("{} commands were passed on; they ceased {} times", counts.received, counts.ceased);
}

Status check_relay(const RelayOptions& options) {
  for (const auto& [key, topic] : {std::pair("--from", options.from), std::pair("--to", options.to)})
    if (!is_topic_name(topic))
      return fail(ErrorCode::InvalidArgument, fmt::format("'{}' is no name of a topic", topic), {.key = key},
                  "Letters, digits and underscores, with slashes between them: /waymark/cmd_vel.");
  if (dds_topic(options.from, ros2::Twist::kType).topic == dds_topic(options.to, ros2::Twist::kType).topic)
    return fail(ErrorCode::InvalidArgument,
                "--from and --to name the same topic: the relay would repeat its own commands for ever",
                {.key = "--to"}, "Name two topics, for example --from /waymark/cmd_vel --to /cmd_vel.");
  return {};
}

Result<RelayCounts> relay_commands(Bus& bus, const RelayOptions& options,
                                   const std::function<bool()>& should_stop) {
  if (Status possible = check_relay(options); !possible) return tl::unexpected(possible.error());
  const std::string_view type = options.stamped ? ros2::TwistStamped::kType : ros2::Twist::kType;
  const auto in = bus.subscribe(dds_topic(options.from, type), {.reliable = false, .depth = 1});
  if (!in) return tl::unexpected(in.error());
  const auto out = bus.advertise(dds_topic(options.to, type), {.depth = 1});
  if (!out) return tl::unexpected(out.error());
  CommandRepeat repeat(options.repeat);
  RelayCounts counts;
  std::optional<Duration> newest;
  while (!should_stop()) {
    const auto message = bus.next(repeat.wait(steady_now()));
    const auto command = message ? decode_command(options.stamped, message->bytes)
                                 : Result<VelocityCommand>(fail(ErrorCode::NotFound, "nothing came"));
    const Duration now = steady_now();
    if (command) {
      repeat.offer(*command, now);
      newest = now;
      ++counts.received;
    } else if (newest && now - *newest > options.repeat.timeout) {
      newest.reset();
      ++counts.ceased;
    }
    const auto due = repeat.due(now);
    if (!due) continue;
    if (Status status = bus.publish(*out, velocity_message_now(*due, options.stamped)); !status)
      return tl::unexpected(status.error());
  }
  if (Status status = publish_zero(bus, *out, options.stamped); !status)
    return tl::unexpected(status.error());
  return counts;
}

}  // namespace waymark
