#include "waymark/robots/gazebo/gazebo_robot.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/robots/gazebo/gazebo_bridge.hpp"
#include "waymark/robots/process/command_sender.hpp"
#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/robots/wire/simulation_watch.hpp"

namespace waymark {
namespace {

constexpr Duration kSlice = std::chrono::milliseconds(20);

class GazeboRobot {
 public:
  GazeboRobot(GazeboLink& link, const GazeboProfile& profile, const RobotDescription& robot,
              const RobotWire& wire, const GazeboRobotOptions& options)
      : link_(link),
        profile_(profile),
        name_(robot.model.name),
        wire_(wire),
        talk_(wire),
        options_(options),
        bridge_(profile, robot, pictures_in_memory()),
        senders_(options.share_commands) {}

  Status run() {
    Status status = join();
    if (!status) return status;
    const auto send = [this](const VelocityCommand& command) {
      (void)link_.publish(publisher_, StampedCommand{.command = command});
    };
    EarlyInput early(wire_);
    std::optional<CommandSender> sender;
    const Duration began = steady_now();
    while (status && talk_.open() && !(sender ? sender->ended() : early.said_bye()) && !wire_.should_stop()) {
      if (const auto message = link_.next(kSlice)) receive(*message);
      const Duration now = steady_now();
      listens_ = (sender ? sender->role() : early.role()) == InputRole::Listens;
      if (!sender && senders_.done(now)) {
        status = greet();
        if (!status) break;
        sender.emplace(send, wire_, early.role());
        watch_.forget();  // to join as a publisher takes longer than the robot may be silent
        continue;
      }
      if (sender) sender->hold(watch_.silent(now));
      if (const std::string words = watch_.take_words(now, !listens_); !words.empty()) talk_.say(words);
      status = talk_.greeted() ? look(now - began) : wait(now - began);
    }
    return status;
  }

 private:
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

  /// The robot is heard, and nobody else commands it: from now on it may be.
  Status greet() {
    const auto others = link_.publishers(profile_.command_topic);
    const std::string who = others.empty() ? "" : fmt::format("at {}", fmt::join(others, ", "));
    const Status alone = senders_.alone(profile_.command_topic, who, "gazebo robot PROFILE");
    if (!alone && !listens_) return alone;
    link_.unsubscribe(profile_.command_topic);  // what comes there from now on is ours, too
    if (!listens_) {
      const auto publisher = link_.advertise(profile_.command_topic, StampedCommand{});
      if (!publisher) return tl::unexpected(publisher.error());
      publisher_ = *publisher;
    }
    talk_.greet(name_, true);
    return {};
  }

  void receive(const GazeboMessage& message) {
    if (message.subscription >= subscriptions_.size()) return senders_.hear_command();
    const GazeboSubscription& from = subscriptions_[message.subscription];
    if (from.kind == GazeboKind::Clock) watch_.clock(message.arrived);
    const auto before = bridge_.simulated_time();
    const auto lines = bridge_.receive(from, message);
    const auto after = bridge_.simulated_time();
    if (after && after != before) watch_.odometry(message.arrived);
    if (bridge_.speaks()) senders_.hear_robot(message.arrived);
    if (!talk_.greeted()) return;
    talk_.write(lines);
    talk_.write(bridge_.take_words());
  }

  /// Of a robot that was heard.
  Status look(Duration waited) {
    if (watch_.ended(steady_now()))
      return fail(ErrorCode::NotFound,
                  fmt::format("neither odometry on {} nor a clock came any more", profile_.odometry_topic),
                  {.source = "Gazebo"}, "Did the simulation end?");
    if (!listens_ && waited > options_.report_after && !link_.heard(publisher_))
      talk_.say_once(fmt::format("nobody subscribes to {}: the robot will not move", profile_.command_topic));
    return {};
  }

  /// For its odometry.
  Status wait(Duration waited) {
    if (senders_.heard_robot()) return {};
    if (waited < options_.report_after || (said_ && waited < options_.give_up_after)) return {};
    said_ = true;
    const std::string found = fmt::format("{}; {}", link_.where(), topics_in_words(link_.topics()));
    if (waited < options_.give_up_after) {
      talk_.say_once(fmt::format("no odometry on {} yet; {}", profile_.odometry_topic, found));
      return {};
    }
    return fail(
        ErrorCode::NotFound, fmt::format("no odometry came on {}; {}", profile_.odometry_topic, found),
        {.source = "Gazebo"},
        "Does the simulation run (is it paused?), are IGN_PARTITION and IGN_IP the same there, has the model "
        "a diff-drive plugin with this topic?");
  }

  GazeboLink& link_;
  GazeboProfile profile_;
  std::string name_;
  const RobotWire& wire_;
  RobotTalk talk_;
  GazeboRobotOptions options_;
  GazeboBridge bridge_;
  SenderWatch senders_;
  SimulationWatch watch_{};
  std::size_t publisher_ = 0;
  std::vector<GazeboSubscription> subscriptions_{};
  bool said_ = false;
  bool listens_ = false;  ///< somebody else drives
};

}  // namespace

std::string topics_in_words(const std::vector<GazeboTopic>& topics) {
  constexpr std::size_t kMost = 30;
  if (topics.empty()) return "nobody publishes anything there";
  std::string words = "published there:";
  for (std::size_t i = 0; i < std::min(topics.size(), kMost); ++i)
    words += fmt::format("{} {} [{}]", i == 0 ? "" : ",", topics[i].name, topics[i].type);
  if (topics.size() > kMost) words += fmt::format(" and {} more", topics.size() - kMost);
  return words;
}

Status run_gazebo_robot(GazeboLink& link, const GazeboProfile& profile, const RobotDescription& robot,
                        const RobotWire& wire, const GazeboRobotOptions& options) {
  return GazeboRobot(link, profile, robot, wire, options).run();
}

}  // namespace waymark
