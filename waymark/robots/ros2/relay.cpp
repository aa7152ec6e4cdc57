#include "waymark/robots/ros2/relay.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/dds/ros_names.hpp"
#include "waymark/robots/ros2/velocity_commands.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

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

/// Says each problem once: first when discovery has had time, then as others come.
class ProblemWatch {
 public:
  ProblemWatch(const Bus& bus, TopicUse from, TopicUse to, const std::function<void(const std::string&)>& say)
      : bus_(bus), from_(std::move(from)), to_(std::move(to)), say_(say) {}

  void look(Duration now) {
    constexpr Duration kPeriod = std::chrono::seconds(2);
    if (now < next_) return;
    next_ = now + kPeriod;
    for (const std::string& problem : relay_problems(from_, to_, bus_.endpoints()))
      if (said_.insert(problem).second) say_(problem);
  }

 private:
  const Bus& bus_;
  TopicUse from_;
  TopicUse to_;
  const std::function<void(const std::string&)>& say_;
  std::set<std::string> said_{};
  Duration next_ = steady_now() + std::chrono::seconds(3);
};

}  // namespace

std::vector<std::string> relay_problems(const TopicUse& from, const TopicUse& to,
                                        const std::vector<BusEndpoint>& others) {
  const auto any = [&others](const TopicUse& use, bool publishes) {
    return std::ranges::any_of(others, [&](const BusEndpoint& endpoint) {
      return endpoint.publishes == publishes && endpoint.name.topic == use.name.topic;
    });
  };
  const auto topic_of = [](const TopicUse& use) { return ros_topic(use.name)->topic; };
  std::vector<std::string> problems = mismatches({from, to}, others);
  if (!any(from, true))
    problems.push_back(fmt::format("nobody publishes {} yet: the robot gets zero", topic_of(from)));
  if (!any(to, false))
    problems.push_back(fmt::format("nobody subscribes to {} yet: no robot hears the relay", topic_of(to)));
  for (const BusEndpoint& other : others)
    if (other.publishes && other.name.topic == to.name.topic && other.name.type != to.name.type)
      problems.push_back(fmt::format("{} is published as {} by another program: is it a topic of commands?",
                                     topic_of(to), ros_topic(other.name)->type));
  if (std::ranges::any_of(others, [&](const BusEndpoint& other) {
        return other.publishes && other.name.topic == to.name.topic && other.name.type == to.name.type;
      }))
    problems.push_back(
        fmt::format("another program publishes {0} too: its commands reach the robot past the relay, between "
                    "zeros. Let it publish {1}",
                    topic_of(to), topic_of(from)));
  return problems;
}

std::string words_of(const RelayOptions& options, int domain) {
  return fmt::format(
      "commands are passed on from {} to {} ({}) in domain {}, until Ctrl-C; zero where none came for {:g} s",
      options.from, options.to, options.stamped ? "TwistStamped" : "Twist", domain,
      to_seconds(options.repeat.timeout));
}

std::string words_of(const RelayCounts& counts) {
  return fmt::format("passed on: {}; they ceased {}", counted(counts.received, "command"),
                     counted(counts.ceased, "time"));
}

Status check_relay(const RelayOptions& options) {
  for (const auto& [key, topic] : {std::pair("from", options.from), std::pair("to", options.to)})
    if (!is_topic_name(topic))
      return fail(ErrorCode::InvalidArgument, fmt::format("'{}' is no name of a topic", topic), {.key = key},
                  "Letters, digits and underscores, with slashes between them: /waymark/cmd_vel.");
  if (dds_topic(options.from, ros2::Twist::kType).topic == dds_topic(options.to, ros2::Twist::kType).topic)
    return fail(ErrorCode::InvalidArgument,
                "`from` and `to` name the same topic: the relay would repeat its own commands for ever",
                {.key = "to"}, "Name two topics, for example `from=/waymark/cmd_vel` `to=/cmd_vel`.");
  return {};
}

BusTopic relay_output(const RelayOptions& options) {
  return dds_topic(options.to, options.stamped ? ros2::TwistStamped::kType : ros2::Twist::kType);
}

Result<RelayCounts> relay_commands(Bus& bus, const RelayOptions& options,
                                   const std::function<void(const std::string&)>& say,
                                   const std::function<bool()>& should_stop) {
  if (Status possible = check_relay(options); !possible) return tl::unexpected(possible.error());
  const std::string_view type = options.stamped ? ros2::TwistStamped::kType : ros2::Twist::kType;
  const TopicUse from{.name = dds_topic(options.from, type), .qos = {.reliable = false, .depth = 1}};
  const TopicUse to{.publishes = true, .name = relay_output(options), .qos = {.depth = 1}};
  const auto in = bus.subscribe(from.name, from.qos);
  if (!in) return tl::unexpected(in.error());
  const auto out = bus.advertise(to.name, to.qos);
  if (!out) return tl::unexpected(out.error());
  CommandRepeat repeat(options.repeat);
  RelayCounts counts;
  std::optional<Duration> newest;
  ProblemWatch watch(bus, from, to, say);
  while (!should_stop()) {
    watch.look(steady_now());
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

Status run_relay(const RelayOptions& options, const BusOptions& network,
                 const std::function<void(const std::string&)>& say,
                 const std::function<bool()>& should_stop) {
  auto guard = ZeroGuard::start(network, say);
  if (!guard) return tl::unexpected(guard.error());
  guard->guard(relay_output(options));
  const auto bus = open_bus(network);
  if (!bus) return tl::unexpected(bus.error());
  say(words_of(options, network.domain));
  const auto counts = relay_commands(**bus, options, say, should_stop);
  if (!counts) return tl::unexpected(counts.error());
  say(words_of(*counts));
  return {};
}

}  // namespace waymark
