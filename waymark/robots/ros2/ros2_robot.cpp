#include "waymark/robots/ros2/ros2_robot.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/dds/ros_names.hpp"
#include "waymark/robots/process/command_sender.hpp"
#include "waymark/robots/ros2/other_publishers.hpp"
#include "waymark/robots/ros2/robot_bridge.hpp"
#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/robots/wire/simulation_watch.hpp"
#include "waymark/robots/wire/wire_loop.hpp"

namespace waymark {
namespace {

constexpr Duration kSlice = std::chrono::milliseconds(50);
constexpr Duration kCheckPeriod = std::chrono::seconds(1);
/// A peer that is not discovered immediately is discovered through its next announcement, a second later.
constexpr Duration kListen = std::chrono::milliseconds(1500);

SensorTime wall_clock() {
  return SensorTime(
      std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch()));
}

constexpr const char* kNothingArrives =
    "it is offered, but no messages arrive: check that its program is not restricted to its own machine "
    "(`localhost`, ROS_LOCALHOST_ONLY) or behind a firewall; ";

class Ros2Robot final : public WireLoop {
 public:
  Ros2Robot(const Ros2Profile& profile, const RobotDescription& robot, BusOptions bus_options,
            const RobotWire& wire, const Ros2RobotOptions& options)
      : WireLoop(wire, {.check_period = kCheckPeriod, .report_again = true}),
        profile_(profile),
        name_(robot.model.name),
        bus_options_(std::move(bus_options)),
        options_(options),
        bridge_(profile, robot, images_in_memory()),
        uses_(uses_of(profile)),
        senders_(options.share_commands, kListen),
        drivers_(command_use(profile).name) {}

  /// Joins the network; to be called before run().
  Status join() {
    auto bus = open_bus(bus_options_);
    if (!bus) return tl::unexpected(bus.error());
    bus_ = std::move(*bus);
    for (Ros2Subscription& one : subscriptions_of(profile_)) {
      const auto number = bus_->subscribe(dds_topic(one.topic, one.type), one.qos);
      if (!number) return tl::unexpected(number.error());
      subscriptions_.emplace(*number, std::move(one));
    }
    const auto others = bus_->subscribe(command_use(profile_).name, {.reliable = false, .depth = 1});
    if (!others) return tl::unexpected(others.error());
    commands_ = *others;
    return names_.join(*bus_);
  }

 private:
  /// The timestamp for a command sent now. May be called from any thread.
  [[nodiscard]] SensorTime stamp_now() const {
    return profile_.use_sim_time ? SensorTime(Duration(simulated_ns_.load())) : wall_clock();
  }

  Status poll_robot() override {
    if (const auto message = bus_->next(kSlice)) receive(*message);
    return stay_alone();
  }
  Result<bool> ready() override { return senders_.done(steady_now()); }
  RobotHello hello() const override {
    return {.name = name_, .simulated_time = profile_.use_sim_time, .simulated = profile_.simulated};
  }
  void send(const VelocityCommand& command) override {
    (void)bus_->publish(*publisher_, bridge_.command(command, stamp_now()));
  }
  bool must_hold(Duration now) const override { return profile_.use_sim_time && watch_.silent(now); }
  std::vector<std::string> silence_reports(Duration now) override {
    return {watch_.take_reports(now, !listens())};
  }

  void receive(const BusMessage& message) {
    if (names_.take(message)) return;
    if (message.subscription == commands_) {
      if (drivers_.receive(message.identity.guid, publisher_.has_value(), *bus_)) senders_.on_other_command();
      return;
    }
    const auto from = subscriptions_.find(message.subscription);
    if (from == subscriptions_.end()) return;
    if (from->second.topic == profile_.odometry_topic) count_robot(message);
    const auto lines = bridge_.receive(from->second, message.bytes, message.arrived);
    if (const auto time = bridge_.simulated_time())
      watch_simulation(from->second, message.arrived, *time, !lines.empty());
    if (bridge_.speaks()) senders_.on_robot_message(message.arrived);
    if (!greeted()) return;
    output().write(lines);
    output().write(bridge_.take_reports());
  }

  /// Checks for other programs that start to command the robot while it is being driven.
  Status stay_alone() {
    if (!publisher_ || options_.share_commands) return {};
    const auto others = drivers_.found(names_, *bus_, steady_now() - advertised_);
    if (!others) return tl::unexpected(others.error());
    if (!others->empty()) output().report_once(*others);
    return {};
  }

  void watch_simulation(const Ros2Subscription& from, Duration arrived, SensorTime time, bool passed) {
    simulated_ns_ = time.time_since_epoch().count();
    if (from.type == ClockMessage::kType) watch_.clock(arrived);
    if (from.topic == profile_.odometry_topic && passed) watch_.odometry(arrived);
  }

  /// Counts the odometry publishers during the last 0.5 s, so that a restarted program counts only once.
  void count_robot(const BusMessage& message) {
    constexpr Duration kMoment = std::chrono::milliseconds(500);
    odometry_sources_[message.identity.guid] = message.arrived;
    std::erase_if(odometry_sources_, [&](const auto& one) { return message.arrived - one.second > kMoment; });
    if (odometry_sources_.size() > 1 && greeted()) output().report_once(two_robots());
  }
  [[nodiscard]] std::string two_robots() const {
    return fmt::format("{} programs publish odometry on {}; there may be several robots in this domain",
                       odometry_sources_.size(), profile_.odometry_topic);
  }

  /// Subscribes to the compressed images (image_transport) if no others are published.
  Status take_compressed() {
    if (profile_.image_topic.empty() || compressed_) return {};
    const std::string topic = profile_.image_topic + "/compressed";
    const std::string_view type = ros2::CompressedImage::kType;
    if (is_published(profile_.image_topic, others_, ros2::Image::kType) ||
        !is_published(topic, others_, type))
      return {};
    compressed_ = true;
    TopicQos qos{.reliable = profile_.reliable_sensors, .depth = 2};
    const auto number = bus_->subscribe(dds_topic(topic, type), qos);
    if (!number) return tl::unexpected(number.error());
    subscriptions_.emplace(*number, Ros2Subscription{topic, std::string(type), qos});
    output().report_once(
        fmt::format("{} has no publisher; using the images of {}", profile_.image_topic, topic));
    return {};
  }

  Status look_for_others() {
    const std::string who = drivers_.names(names_, *bus_);
    if (Status alone = senders_.check_alone(profile_.command_topic, who, "ros2 robot PROFILE"); !alone)
      return alone;
    if (odometry_sources_.size() > 1 && !options_.share_commands)
      return fail(
          ErrorCode::InvalidArgument, two_robots(), {.source = "ROS 2"},
          "A command would move all of them. Set a ROS_DOMAIN_ID for each robot, or a namespace and its "
          "topics in the profile.");
    return {};
  }

  /// Adds the command publisher unless another program commands the robot or this program only listens.
  Status prepare() override {
    if (!listens())
      if (Status alone = look_for_others(); !alone) return alone;
    if (listens()) {
      bus_->unsubscribe(commands_);
      return {};
    }
    const TopicUse commands = command_use(profile_);
    const auto publisher = bus_->advertise(commands.name, commands.qos);
    if (!publisher) return tl::unexpected(publisher.error());
    publisher_ = *publisher;
    advertised_ = steady_now();
    return {};
  }

  void after_hello() override {
    report_clock();
    if (profile_.image_topic.empty() && profile_.compressed_image_topic.empty() &&
        profile_.detections_topic.empty())
      output().report_once(
          "the profile has no topic for images or tags (image_topic, compressed_image_topic, "
          "detections_topic): localization requires a camera of this computer (`camera_source`)");
    if (!profile_.stops_by_itself && !listens())
      output().report_once(
          "the robot does not stop by itself if commands cease: if the network may fail, run `waymark ros2 "
          "relay` on the robot");
  }

  /// Reports the offset between the clocks, which includes the delay of the messages.
  void report_clock() {
    constexpr double kYear_s = 3e7;
    if (profile_.use_sim_time || !bridge_.offset()) return;
    const Duration robot = steady_now() - *bridge_.offset();
    const double behind_s = to_seconds(wall_clock().time_since_epoch() - robot);
    const bool other = std::abs(behind_s) > kYear_s;
    output().report_once(
        fmt::format("the robot's clock is {:.3f} s {} this computer's according to the stamps of {}{}",
                    std::abs(behind_s), behind_s >= 0 ? "behind" : "ahead of", profile_.odometry_topic,
                    other ? "; for simulated time, set use_sim_time: true in the profile" : ""));
  }

  /// Examines the other endpoints, once a second.
  Status check() override {
    others_ = bus_->endpoints();
    for (const std::string& reason : mismatches(uses_, others_)) output().report_once(reason);
    if (Status status = take_compressed(); !status) return status;
    if (senders_.has_robot()) report_missing();
    return {};
  }

  void report_missing() {
    if (waited() > kListen && greeted())
      for (const std::string& missing : missing_publishers(profile_, others_)) output().report_once(missing);
    const BusTopic commands = command_use(profile_).name;
    const bool has_subscriber = std::ranges::any_of(others_, [&](const BusEndpoint& other) {
      return !other.publishes && other.name.topic == commands.topic && other.name.type == commands.type;
    });
    if (publisher_ && steady_now() - advertised_ > kListen && !has_subscriber)
      output().report_once(
          fmt::format("{} has no subscriber: the robot will not move", profile_.command_topic));
  }

  bool waits() const override { return !senders_.has_robot(); }

  NoContact no_contact() override {
    const std::string where = why_nothing_came() + searched(bus_options_, *bus_);
    return {.report = fmt::format("no odometry on {} yet; {}", profile_.odometry_topic, where),
            .gave_up = fail(
                ErrorCode::NotFound, fmt::format("no odometry on {}; {}", profile_.odometry_topic, where),
                {.source = "ROS 2"},
                (others_.empty() ? std::string()
                                 : "Check the topic's name in the profile (`waymark ros2 topic list`). ") +
                    "Check that the robot is on, that its ROS_DOMAIN_ID is the same, and that no firewall "
                    "blocks UDP.")};
  }

  [[nodiscard]] bool waits_for_clock() const { return profile_.use_sim_time && !bridge_.simulated_time(); }

  [[nodiscard]] std::string why_nothing_came() const {
    if (waits_for_clock() && !is_published("/clock", others_))
      return "/clock has no publisher, but the profile requires it (use_sim_time); ";
    if (waits_for_clock()) return "no messages on /clock (use_sim_time); ";
    const bool fits = mismatches(uses_, others_).empty();
    return fits && is_published(profile_.odometry_topic, others_) ? kNothingArrives : "";
  }

  Ros2Profile profile_;
  std::string name_;
  BusOptions bus_options_;
  Ros2RobotOptions options_;
  RobotBridge bridge_;
  std::vector<TopicUse> uses_;
  std::unique_ptr<Bus> bus_{};
  SenderWatch senders_;
  OtherDrivers drivers_;
  SimulationWatch watch_{};
  std::atomic<std::int64_t> simulated_ns_ = 0;
  std::map<Guid, Duration> odometry_sources_{};  ///< newest arrival time for each publisher
  PublisherNames names_{};
  std::optional<std::size_t> publisher_{};
  Duration advertised_{};
  std::size_t commands_ = 0;                                 ///< subscription to the command topic
  std::map<std::size_t, Ros2Subscription> subscriptions_{};  ///< by number
  bool compressed_ = false;
  std::vector<BusEndpoint> others_{};  ///< endpoints found by the newest check()
};

}  // namespace

Status run_ros2_robot(const Ros2Profile& profile, const RobotDescription& robot,
                      const BusOptions& bus_options, const RobotWire& wire, const Ros2RobotOptions& options) {
  Ros2Robot process(profile, robot, bus_options, wire, options);
  if (Status joined = process.join(); !joined) return joined;
  return process.run();
}

}  // namespace waymark
