#include <algorithm>
#include <chrono>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/doctor/doctor_network.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/config/share.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/robots/dds/open_bus.hpp"
#include "waymark/robots/dds/ros_names.hpp"
#include "waymark/robots/ros2/profile.hpp"
#include "waymark/robots/ros2/publisher_names.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr const char* kRos2HowTo = "docs/howto/ros2.md";

/// sensor_msgs/msg/BatteryState, as far as it is read.
struct BatteryBegin {
  static constexpr std::string_view kType = "sensor_msgs/msg/BatteryState";
  ros2::Header header{};
  float voltage = 0, temperature = 0, current = 0, charge = 0, capacity = 0, design_capacity = 0;
  float percentage = 0;  ///< 0 to 1; NaN: not measured
  WAYMARK_ROS2_FIELDS(self.header, self.voltage, self.temperature, self.current, self.charge, self.capacity,
                      self.design_capacity, self.percentage)
};

class Ros2Listener {
 public:
  Ros2Listener(Bus& bus, const Ros2Profile& profile) : bus_(bus), profile_(profile) {
    heard_.odometry = profile.odometry_topic;
    heard_.commands = profile.command_topic;
  }

  Status listen(Duration most, const DoctorCancelled& cancelled) {
    constexpr TopicQos kAny{.reliable = false, .depth = 100};
    const auto odometry = bus_.subscribe(dds_topic(profile_.odometry_topic, ros2::Odometry::kType), kAny);
    if (!odometry) return tl::unexpected(odometry.error());
    const auto commands = bus_.subscribe(command_use(profile_).name, kAny);
    if (!commands) return tl::unexpected(commands.error());
    const auto battery = bus_.subscribe(dds_topic("/battery_state", BatteryBegin::kType), kAny);
    if (!battery) return tl::unexpected(battery.error());
    if (Status joined = names_.join(bus_); !joined) return joined;
    const Duration until = steady_now() + most;
    while (steady_now() < until && !cancelled()) {
      const auto message = bus_.next(std::min(kDoctorSlice, until - steady_now()));
      if (!message || names_.take(*message)) continue;
      if (message->subscription == *commands) hear_command(*message);
      if (message->subscription == *odometry) hear_odometry(*message);
      if (message->subscription == *battery) hear_battery(message->bytes);
    }
    heard_.listened_s = to_seconds(most);
    name_drivers();
    const auto endpoints = bus_.endpoints();
    heard_.hears_commands = std::ranges::any_of(endpoints, [&](const BusEndpoint& endpoint) {
      return !endpoint.publishes && endpoint.name.topic == command_use(profile_).name.topic;
    });
    return {};
  }
  [[nodiscard]] NetworkHeard& heard() { return heard_; }
  /// One command would move all of them.
  [[nodiscard]] std::vector<DoctorLine> robot_lines() const {
    if (robots_.size() < 2) return {};
    return {{"robots", DoctorLevel::Fail,
             fmt::format("{} programs publish odometry on {}: are there two robots in this domain?",
                         robots_.size(), profile_.odometry_topic),
             "Give each a ROS_DOMAIN_ID, or a namespace and the topics of its profile."}};
  }

 private:
  void hear_command(const BusMessage& message) {
    ++heard_.others_commands;
    drivers_.insert(message.identity.guid);
  }
  void name_drivers() {
    heard_.driver = names_.of(drivers_, bus_);
    const std::set<Guid> all = publishers_of(command_use(profile_).name, bus_);
    heard_.silent_publishers = static_cast<int>(all.size());
    heard_.silent_names = names_.of(all, bus_);
  }
  void hear_odometry(const BusMessage& message) {
    const auto odometry = cdr::decode<ros2::Odometry>(message.bytes);
    if (!odometry) return;
    robots_.insert(message.identity.guid);
    ++heard_.odometries;
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const Duration stamp = ros2::from_ros(odometry->header.stamp).time_since_epoch();
    const double behind_s = to_seconds(std::chrono::duration_cast<Duration>(now) - stamp);
    heard_.behind_s = std::min(heard_.behind_s.value_or(behind_s), behind_s);
  }
  void hear_battery(std::span<const std::uint8_t> bytes) {
    const auto battery = cdr::decode<BatteryBegin>(bytes);
    if (!battery) return;
    heard_.battery_V = battery->voltage;
    if (battery->percentage >= 0 && battery->percentage <= 1) heard_.battery_share = battery->percentage;
  }

  Bus& bus_;
  const Ros2Profile& profile_;
  NetworkHeard heard_{};
  PublisherNames names_{};
  std::set<Guid> robots_{};   ///< publishers of odometry that came
  std::set<Guid> drivers_{};  ///< publishers of commands that came
};

/// What the profile names and a drive would not find.
std::vector<DoctorLine> profile_lines(const Ros2Profile& profile) {
  std::vector<DoctorLine> lines;
  const auto wrong = [&](const Error& error) {
    lines.push_back({"profile", DoctorLevel::Fail, to_string(error), "docs/formats/ros2-profile.md"});
  };
  const auto file = find_shared("robots", profile.robot);
  if (!file) {
    wrong(file.error());
  } else if (const auto robot = read_robot(*file); !robot) {
    wrong(robot.error());
  }
  return lines;
}

/// Who is there, and which of the profile's topics cannot be heard.
std::vector<DoctorLine> peer_lines(const Bus& bus, const BusOptions& options, const Ros2Profile& profile) {
  const bool alone = bus.participants().empty();
  std::vector<DoctorLine> lines = {{"peers", alone ? DoctorLevel::Fail : DoctorLevel::Ok,
                                    searched(options, bus),
                                    alone ? "echo $ROS_DOMAIN_ID, on both computers" : ""}};
  for (const std::string& words : mismatches(uses_of(profile), bus.endpoints()))
    lines.push_back({"qos", DoctorLevel::Fail, words, "docs/formats/ros2-profile.md"});
  if (lines.size() == 1 && !alone)
    lines.push_back(
        {"qos", DoctorLevel::Ok, "no topic of the profile is offered in a way that excludes it", ""});
  if (!alone)
    for (const std::string& words : missing_publishers(profile, bus.endpoints()))
      lines.push_back({"topics", DoctorLevel::Fail, words, "waymark ros2 topic list"});
  return lines;
}

}  // namespace

std::vector<DoctorLine> check_ros2(const std::string& profile, const DoctorCancelled& cancelled) {
  constexpr Duration kListen = std::chrono::seconds(3);
  const auto failed = [](const Error& error) {
    return std::vector<DoctorLine>{{"robot", DoctorLevel::Fail, to_string(error), kRos2HowTo}};
  };
  const auto found = find_ros2_profile(profile);
  if (!found) return failed(found.error());
  const auto options = network_of(*found, "waymark_doctor");
  if (!options) return failed(options.error());
  const auto bus = open_bus(*options);
  if (!bus) return failed(bus.error());
  Ros2Listener listener(**bus, *found);
  if (Status status = listener.listen(kListen, cancelled); !status) return failed(status.error());
  std::vector<DoctorLine> lines = network_lines(listener.heard(), kRos2HowTo);
  for (DoctorLine& line : listener.robot_lines()) lines.push_back(std::move(line));
  for (DoctorLine& line : profile_lines(*found)) lines.push_back(std::move(line));
  for (DoctorLine& line : peer_lines(**bus, *options, *found)) lines.push_back(std::move(line));
  return lines;
}

}  // namespace waymark
