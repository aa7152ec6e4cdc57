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

/// Reports each problem once, after allowing time for discovery.
class ProblemWatch {
 public:
  ProblemWatch(const Bus& bus, TopicUse from, TopicUse to,
               const std::function<void(const std::string&)>& report)
      : bus_(bus), from_(std::move(from)), to_(std::move(to)), report_(report) {}

  void check(Duration now) {
    constexpr Duration kPeriod = std::chrono::seconds(2);
    if (now < next_) return;
    next_ = now + kPeriod;
    for (const std::string& problem : relay_problems(from_, to_, bus_.endpoints()))
      if (reported_.insert(problem).second) report_(problem);
  }

 private:
  const Bus& bus_;
  TopicUse from_;
  TopicUse to_;
  const std::function<void(const std::string&)>& report_;
  std::set<std::string> reported_{};
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
    problems.push_back(fmt::format("{} has no publisher yet: the robot receives zero", topic_of(from)));
  if (!any(to, false))
    problems.push_back(fmt::format("{} has no subscriber yet: no robot receives commands", topic_of(to)));
  for (const BusEndpoint& other : others)
    if (other.publishes && other.name.topic == to.name.topic && other.name.type != to.name.type)
      problems.push_back(fmt::format("another program publishes {} as {}: check that it is the command topic",
                                     topic_of(to), ros_topic(other.name)->type));
  if (std::ranges::any_of(others, [&](const BusEndpoint& other) {
        return other.publishes && other.name.topic == to.name.topic && other.name.type == to.name.type;
      }))
    problems.push_back(
        fmt::format("another program also publishes {0}, so its commands bypass the relay: configure it to "
                    "publish {1}",
                    topic_of(to), topic_of(from)));
  return problems;
}

std::string relay_start_text(const RelayOptions& options, int domain) {
  return fmt::format(
      "forwarding commands from {} to {} ({}) in domain {} until Ctrl-C; zero if none comes for {:g} s",
      options.from, options.to, options.stamped ? "TwistStamped" : "Twist", domain,
      to_seconds(options.repeat.timeout));
}

std::string relay_end_text(const RelayCounts& counts) {
  return fmt::format("forwarded {}; they stopped {}", counted(counts.received, "command"),
                     counted(counts.ceased, "time"));
}

Status check_relay(const RelayOptions& options) {
  for (const auto& [key, topic] : {std::pair("from", options.from), std::pair("to", options.to)})
    if (!is_topic_name(topic))
      return fail(ErrorCode::InvalidArgument, fmt::format("invalid topic name '{}'", topic), {.key = key},
                  "Use letters, digits and underscores, separated by slashes: /waymark/cmd_vel.");
  if (dds_topic(options.from, ros2::Twist::kType).topic == dds_topic(options.to, ros2::Twist::kType).topic)
    return fail(ErrorCode::InvalidArgument,
                "`from` and `to` are the same topic, so the relay would repeat its own commands",
                {.key = "to"}, "Use two topics, for example `from=/waymark/cmd_vel` `to=/cmd_vel`.");
  return {};
}

BusTopic relay_output(const RelayOptions& options) {
  return dds_topic(options.to, options.stamped ? ros2::TwistStamped::kType : ros2::Twist::kType);
}

Result<RelayCounts> relay_commands(Bus& bus, const RelayOptions& options,
                                   const std::function<void(const std::string&)>& report,
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
  ProblemWatch watch(bus, from, to, report);
  while (!should_stop()) {
    watch.check(steady_now());
    const auto message = bus.next(repeat.wait(steady_now()));
    const auto command = message ? decode_command(options.stamped, message->bytes)
                                 : Result<VelocityCommand>(fail(ErrorCode::NotFound, "no message"));
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
                 const std::function<void(const std::string&)>& report,
                 const std::function<bool()>& should_stop) {
  auto guard = ZeroGuard::start(network, report);
  if (!guard) return tl::unexpected(guard.error());
  guard->guard(relay_output(options));
  const auto bus = open_bus(network);
  if (!bus) return tl::unexpected(bus.error());
  report(relay_start_text(options, network.domain));
  const auto counts = relay_commands(**bus, options, report, should_stop);
  if (!counts) return tl::unexpected(counts.error());
  report(relay_end_text(*counts));
  return {};
}

}  // namespace waymark
