#include "waymark/robots/gazebo/gazebo_robot.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/robots/gazebo/gazebo_bridge.hpp"
#include "waymark/robots/process/command_sender.hpp"
#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/robots/wire/simulation_watch.hpp"
#include "waymark/robots/wire/wire_loop.hpp"

namespace waymark {
namespace {

constexpr Duration kSlice = std::chrono::milliseconds(20);
/// Time allowed for discovering the subscribers to the commands.
constexpr Duration kDiscovery = std::chrono::seconds(3);

class GazeboRobot final : public WireLoop {
 public:
  GazeboRobot(GazeboLink& link, const GazeboProfile& profile, const RobotDescription& robot,
              const RobotWire& wire, const GazeboRobotOptions& options)
      : WireLoop(wire),
        link_(link),
        profile_(profile),
        name_(robot.model.name),
        bridge_(profile, robot, images_in_memory()),
        senders_(options.share_commands) {}

  /// Joins the network; to be called before run().
  Status join() {
    for (GazeboSubscription& one : subscriptions_of(profile_)) {
      const auto number = link_.subscribe(one.topic, one.depth);
      if (!number) return tl::unexpected(number.error());
      subscriptions_.push_back(std::move(one));
    }
    const auto commands = link_.subscribe(profile_.command_topic, 1);
    if (!commands) return tl::unexpected(commands.error());
    return {};
  }

 private:
  Status poll_robot() override {
    if (const auto message = link_.next(kSlice)) receive(*message);
    return {};
  }
  Result<bool> ready() override { return senders_.done(steady_now()); }

  /// Called after the robot's first message. Fails if another program commands the robot; otherwise adds the
  /// publisher.
  Status prepare() override {
    const auto others = link_.publishers(profile_.command_topic);
    const std::string who = others.empty() ? "" : fmt::format("at {}", fmt::join(others, ", "));
    const Status alone = senders_.check_alone(profile_.command_topic, who, "gazebo robot PROFILE");
    if (!alone && !listens()) return alone;
    link_.unsubscribe(profile_.command_topic);  // from now on, the topic also carries our own commands
    if (listens()) return {};
    const auto publisher = link_.advertise(profile_.command_topic, StampedCommand{});
    if (!publisher) return tl::unexpected(publisher.error());
    publisher_ = *publisher;
    return {};
  }
  RobotHello hello() const override { return {.name = name_, .simulated_time = true}; }
  /// Adding the publisher takes longer than the robot is allowed to be silent.
  void after_hello() override { watch_.reset(); }
  void send(const VelocityCommand& command) override {
    (void)link_.publish(publisher_, StampedCommand{.command = command});
  }
  bool must_hold(Duration now) const override { return watch_.silent(now); }
  std::vector<std::string> silence_reports(Duration now) override {
    return {watch_.take_reports(now, !listens())};
  }

  void receive(const GazeboMessage& message) {
    if (message.subscription >= subscriptions_.size()) return senders_.on_other_command();
    const GazeboSubscription& from = subscriptions_[message.subscription];
    if (from.kind == GazeboKind::Clock) watch_.clock(message.arrived);
    const auto before = bridge_.simulated_time();
    const auto lines = bridge_.receive(from, message);
    const auto after = bridge_.simulated_time();
    if (after && after != before) watch_.odometry(message.arrived);
    if (bridge_.speaks()) senders_.on_robot_message(message.arrived);
    if (!greeted()) return;
    output().write(lines);
    output().write(bridge_.take_reports());
  }

  /// Only checks after the hello, because before that subscribers cannot have discovered the publisher.
  Status check() override {
    if (!std::exchange(was_greeted_, greeted())) return {};
    if (watch_.ended(steady_now()))
      return fail(ErrorCode::NotFound,
                  fmt::format("odometry on {} and the clock have stopped", profile_.odometry_topic),
                  {.source = "Gazebo"}, "Check whether the simulation still runs.");
    if (!listens() && waited() > kDiscovery && !link_.has_subscriber(publisher_))
      output().report_once(
          fmt::format("{} has no subscriber: the robot will not move", profile_.command_topic));
    return {};
  }

  bool waits() const override { return !senders_.has_robot(); }

  NoContact no_contact() override {
    const std::string found = fmt::format("{}; {}", link_.where(), topic_list_text(link_.topics()));
    return {.report = fmt::format("no odometry on {} yet; {}", profile_.odometry_topic, found),
            .gave_up = fail(ErrorCode::NotFound,
                            fmt::format("no odometry on {}; {}", profile_.odometry_topic, found),
                            {.source = "Gazebo"},
                            "Check that the simulation runs and is not paused, that IGN_PARTITION and IGN_IP "
                            "are the same there, "
                            "and that the model has a diff-drive plugin with this topic.")};
  }

  GazeboLink& link_;
  GazeboProfile profile_;
  std::string name_;
  GazeboBridge bridge_;
  SenderWatch senders_;
  SimulationWatch watch_{};
  std::size_t publisher_ = 0;
  std::vector<GazeboSubscription> subscriptions_{};
  bool was_greeted_ = false;
};

}  // namespace

std::string topic_list_text(const std::vector<GazeboTopic>& topics) {
  constexpr std::size_t kMaxListed = 30;
  if (topics.empty()) return "found no topics";
  std::string text = "found topics:";
  for (std::size_t i = 0; i < std::min(topics.size(), kMaxListed); ++i)
    text += fmt::format("{} {} [{}]", i == 0 ? "" : ",", topics[i].name, topics[i].type);
  if (topics.size() > kMaxListed) text += fmt::format(" and {} more", topics.size() - kMaxListed);
  return text;
}

Status run_gazebo_robot(GazeboLink& link, const GazeboProfile& profile, const RobotDescription& robot,
                        const RobotWire& wire, const GazeboRobotOptions& options) {
  GazeboRobot process(link, profile, robot, wire, options);
  if (Status joined = process.join(); !joined) return joined;
  return process.run();
}

}  // namespace waymark
