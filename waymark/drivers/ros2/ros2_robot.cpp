#include "waymark/drivers/ros2/ros2_robot.hpp"

#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/drivers/dds/open_bus.hpp"
#include "waymark/drivers/dds/ros_names.hpp"
#include "waymark/drivers/process/command_sender.hpp"
#include "waymark/drivers/process/sender_watch.hpp"
#include "waymark/drivers/ros2/robot_bridge.hpp"
#include "waymark/drivers/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr Duration kSlice = std::chrono::milliseconds(50);
constexpr Duration kLookAgain = std::chrono::seconds(1);

SensorTime wall_clock() {
  return SensorTime(
      std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()));
}

class Ros2Robot {
 public:
  Ros2Robot(const Ros2Profile& profile, const RobotDescription& robot, BusOptions bus_options,
            const RobotWire& wire, const Ros2RobotOptions& options)
      : profile_(profile),
        name_(robot.model.name),
        bus_options_(std::move(bus_options)),
        wire_(wire),
        talk_(wire),
        options_(options),
        bridge_(profile, robot, pictures_in_memory()),
        uses_(uses_of(profile)),
        senders_(options.share_commands) {}

  Status run() {
    if (Status status = join(); !status) return status;
    const auto send = [this](const VelocityCommand& command) {
      (void)bus_->publish(publisher_, bridge_.command(command, wall_clock()));
    };
    EarlyInput early(wire_.input);
    std::optional<CommandSender> sender;
    began_ = steady_now();
    while (talk_.open() && !(sender ? sender->ended() : early.said_bye()) && !wire_.should_stop()) {
      const auto message = bus_->next(kSlice);
      if (message) receive(*message);
      if (!sender && senders_.done(steady_now())) {
        if (Status alone = look_for_others(); !alone) return alone;
        greet();
        sender.emplace(send, wire_);
      }
      if (Status status = look(); !status) return status;
    }
    return {};
  }

 private:
  Status join() {
    auto bus = open_bus(bus_options_);
    if (!bus) return tl::unexpected(bus.error());
    bus_ = std::move(*bus);
    const TopicUse commands = command_use(profile_);
    if (!wire_.listen_only) {
      const auto publisher = bus_->advertise(commands.name, commands.qos);
      if (!publisher) return tl::unexpected(publisher.error());
      publisher_ = *publisher;
    }
    for (Ros2Subscription& one : subscriptions_of(profile_)) {
      const auto number = bus_->subscribe(dds_topic(one.topic, one.type), one.qos);
      if (!number) return tl::unexpected(number.error());
      subscriptions_.push_back(std::move(one));
    }
    const auto others = bus_->subscribe(commands.name, {.reliable = false, .depth = 1});
    if (!others) return tl::unexpected(others.error());
    commands_ = *others;
    return {};
  }

  void receive(const BusMessage& message) {
    if (message.subscription == commands_) return senders_.hear_command();
    const auto lines = bridge_.receive(subscriptions_[message.subscription], message.bytes, message.arrived);
    if (bridge_.speaks()) senders_.hear_robot(message.arrived);
    if (!talk_.greeted()) return;
    talk_.write(lines);
    talk_.write(bridge_.take_words());
  }

  Status look_for_others() {
    const auto nodes = bus_->participants();
    const std::string who = nodes.empty() ? "" : fmt::format("one of the nodes {}", fmt::join(nodes, ", "));
    if (Status alone = senders_.alone(profile_.command_topic, who, "ros2 robot PROFILE"); !alone)
      return alone;
    bus_->unsubscribe(commands_);  // what comes there from now on is ours, too
    return {};
  }

  void greet() {
    talk_.greet(name_, false, profile_.simulated);
    if (!profile_.stops_by_itself && !wire_.listen_only)
      talk_.say_once(
          "the robot does not stop by itself when commands cease: where the network may fail, run `waymark "
          "ros2 "
          "relay` on it");
  }

  /// Who is there, once a second.
  Status look() {
    const Duration now = steady_now();
    if (now < next_look_) return {};
    next_look_ = now + kLookAgain;
    for (const std::string& words : mismatches(uses_, bus_->endpoints())) talk_.say_once(words);
    const Duration waited = now - began_;
    if (senders_.heard_robot()) {
      if (talk_.greeted() && !wire_.listen_only && bus_->matched_subscriptions(publisher_) == 0 &&
          waited > options_.report_after)
        talk_.say_once(
            fmt::format("nobody subscribes to {}: the robot will not move", profile_.command_topic));
      return {};
    }
    const std::string where = searched(bus_options_, *bus_);
    if (waited >= options_.give_up_after)
      return fail(ErrorCode::NotFound,
                  fmt::format("no odometry came on {}; {}", profile_.odometry_topic, where),
                  {.source = "ROS 2"},
                  "Is the robot on, is ROS_DOMAIN_ID the same there, does a firewall block UDP?");
    if (waited >= options_.report_after)
      talk_.say_once(fmt::format("no odometry on {} yet; {}", profile_.odometry_topic, where));
    return {};
  }

  Ros2Profile profile_;
  std::string name_;
  BusOptions bus_options_;
  const RobotWire& wire_;
  RobotTalk talk_;
  Ros2RobotOptions options_;
  RobotBridge bridge_;
  std::vector<TopicUse> uses_;
  std::unique_ptr<Bus> bus_{};
  SenderWatch senders_;
  std::size_t publisher_ = 0;
  std::size_t commands_ = 0;  ///< subscription of what others command
  std::vector<Ros2Subscription> subscriptions_{};
  Duration began_{};
  Duration next_look_{};
};

}  // namespace

Status run_ros2_robot(const Ros2Profile& profile, const RobotDescription& robot,
                      const BusOptions& bus_options, const RobotWire& wire, const Ros2RobotOptions& options) {
  return Ros2Robot(profile, robot, bus_options, wire, options).run();
}

}  // namespace waymark
