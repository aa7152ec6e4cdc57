#include "waymark/app/doctor/robot_checks.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>
#include <string>
#include <variant>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/config/share.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/recording/lcm/mbot_messages.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/dds/ros_names.hpp"
#include "waymark/robots/gazebo/gazebo_robot.hpp"
#include "waymark/robots/mbot/lcm_link.hpp"
#include "waymark/robots/process/command_sender.hpp"
#include "waymark/robots/ros2/other_publishers.hpp"
#include "waymark/robots/ros2/profile.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

/// Maximum time to wait for a message before checking for cancellation.
constexpr Duration kDoctorSlice = std::chrono::milliseconds(100);

DoctorLine odometry_line(const NetworkTraffic& traffic, const std::string& howto) {
  constexpr double kLeastRateHz = 10;
  if (traffic.odometries == 0)
    return {"robot", DoctorLevel::Fail,
            fmt::format("no odometry on {} in {:.1f} s{}{}", traffic.odometry, traffic.listened_s,
                        traffic.there.empty() ? "" : "; ", traffic.there),
            howto};
  const double rate_Hz = traffic.odometries / (traffic.listened_s * traffic.sim_pace.value_or(1));
  const bool slow = rate_Hz < kLeastRateHz;
  return {"robot", slow ? DoctorLevel::Warn : DoctorLevel::Ok,
          fmt::format("odometry on {} {:.0f} times per {}second", traffic.odometry, rate_Hz,
                      traffic.sim_pace ? "simulated " : ""),
          slow ? howto : ""};
}

DoctorLine clock_line(double behind_s) {
  constexpr double kApart_s = 0.1;
  const bool differs = std::abs(behind_s) > kApart_s;
  return {"clock", differs ? DoctorLevel::Warn : DoctorLevel::Ok,
          differs ? fmt::format("the robot's stamps are {:.2f} s {} this computer's clock: images of this "
                                "computer's cameras cannot be matched to them",
                                std::abs(behind_s), behind_s > 0 ? "behind" : "ahead of")
                  : fmt::format("the robot's stamps are within {:.0f} ms of this computer's clock",
                                1e3 * std::abs(behind_s)),
          differs ? "chronyc tracking, on both computers" : ""};
}

DoctorLine commands_line(const NetworkTraffic& traffic, const std::string& howto) {
  if (traffic.others_commands >= kMinCommandsOfDriver)
    return {"commands", DoctorLevel::Fail,
            fmt::format("another program commands this robot on {}{}", traffic.commands,
                        traffic.driver.empty() ? "" : ": " + traffic.driver),
            "End that program: the robot would obey the commands of both."};
  if (traffic.silent_publishers > 0)
    return {"commands", DoctorLevel::Warn,
            fmt::format("{} {} on {} too, but sent nothing in {:.1f} s{}",
                        traffic.silent_publishers == 1 ? "another program" : "other programs",
                        traffic.silent_publishers == 1 ? "publishes" : "publish", traffic.commands,
                        traffic.listened_s, traffic.silent_names.empty() ? "" : ": " + traffic.silent_names),
            "End programs that drive the robot; a drive is refused while they send commands."};
  if (!traffic.has_subscriber)
    return {"commands", DoctorLevel::Fail,
            "no subscriber on " + traffic.commands + ": the robot would not move", howto};
  return {"commands", DoctorLevel::Ok, "no commands of other programs on " + traffic.commands, ""};
}

DoctorLine battery_line(const NetworkTraffic& traffic) {
  constexpr double kLow = 0.2;
  const bool low = traffic.battery_share && *traffic.battery_share < kLow;
  std::string words = fmt::format("{:.1f} V", *traffic.battery_V);
  if (traffic.battery_share) words += fmt::format(", {:.0f} %", 100 * *traffic.battery_share);
  return {"battery", low ? DoctorLevel::Warn : DoctorLevel::Ok, words,
          low ? "Charge the robot before a drive." : ""};
}

}  // namespace

std::vector<DoctorLine> network_lines(const NetworkTraffic& traffic, const std::string& howto) {
  std::vector<DoctorLine> lines = {odometry_line(traffic, howto)};
  if (traffic.odometries == 0) return lines;
  lines.push_back(commands_line(traffic, howto));
  if (traffic.behind_s) lines.push_back(clock_line(*traffic.behind_s));
  if (traffic.sim_pace)
    lines.push_back({"clock", DoctorLevel::Ok,
                     fmt::format("real-time factor of the simulation: {:.2f}", *traffic.sim_pace), ""});
  if (traffic.battery_V) lines.push_back(battery_line(traffic));
  return lines;
}

namespace {

constexpr const char* kHowTo = "docs/howto/limo.md";

DoctorLine check_frames(const std::string& port, const LimoPortActivity& traffic) {
  constexpr double kLeastRateHz = 20;
  if (traffic.bytes == 0)
    return {"robot", DoctorLevel::Fail,
            port + ": no data. Is LIMO switched on? Is this the port of its mainboard?", kHowTo};
  if (traffic.frames == 0)
    return {"robot", DoctorLevel::Fail, fmt::format("{}: {} bytes, but no LIMO frame", port, traffic.bytes),
            kHowTo};
  const std::string words =
      fmt::format("{}: motion at {:.0f} Hz, gyro at {:.0f} Hz, {} of {} bytes damaged", port,
                  traffic.motion_rate_hz, traffic.gyro_rate_hz, traffic.skipped_bytes, traffic.bytes);
  const bool slow = traffic.motion_rate_hz < kLeastRateHz || traffic.gyro_rate_hz < kLeastRateHz;
  const bool damaged = 100 * traffic.skipped_bytes > traffic.bytes;
  return {"robot", slow || damaged ? DoctorLevel::Warn : DoctorLevel::Ok, words,
          slow || damaged ? kHowTo : ""};
}

DoctorLine check_battery(const LimoState& state) {
  constexpr double kLowVolts = 10.5;
  const bool low = state.battery_V < kLowVolts;
  return {"battery", low ? DoctorLevel::Warn : DoctorLevel::Ok, fmt::format("{:.1f} V", state.battery_V),
          low ? "Charge LIMO before a drive." : ""};
}

DoctorLine check_errors(const LimoState& state) {
  std::vector<std::string> words = limo_error_texts(state.errors);
  if (state.vehicle == LimoState::Vehicle::EmergencyStop) words.emplace_back("emergency stop");
  if (state.vehicle == LimoState::Vehicle::Exception) words.emplace_back("exception");
  if (words.empty()) return {"errors", DoctorLevel::Ok, "LIMO reports no errors", ""};
  const bool stops = (state.errors & kLimoStoppingErrors) != 0 || state.vehicle != LimoState::Vehicle::Normal;
  return {"errors", stops ? DoctorLevel::Fail : DoctorLevel::Warn,
          fmt::format("LIMO reports: {}", fmt::join(words, "; ")),
          stops ? "Switch LIMO off and on; a drive is refused while it reports this." : kHowTo};
}

DoctorLine check_drive(const LimoState& state) {
  return {"drive", DoctorLevel::Ok,
          fmt::format("{}; {}", to_string(state.drive),
                      state.commanded ? "controlled by this port"
                                      : "not controlled by this port yet; a drive requests it"),
          state.drive == LimoDrive::Ackermann ? "`robot_file=limo-ackermann`" : ""};
}

/// The lines that describe the received data.
std::vector<DoctorLine> limo_lines(const std::string& port, const LimoPortActivity& traffic) {
  std::vector<DoctorLine> lines = {check_frames(port, traffic)};
  if (traffic.frames == 0) return lines;
  if (!traffic.state) {
    lines.push_back({"errors", DoctorLevel::Fail, "LIMO's state (0x211) did not arrive", kHowTo});
    return lines;
  }
  lines.push_back(check_battery(*traffic.state));
  lines.push_back(check_errors(*traffic.state));
  lines.push_back(check_drive(*traffic.state));
  return lines;
}

}  // namespace

std::vector<DoctorLine> check_limo(const std::string& port, const DoctorCancelled& cancelled) {
  constexpr Duration kListenFor = std::chrono::milliseconds(1500);
  const auto traffic = listen_to_limo(port, kListenFor, cancelled);
  if (traffic) return limo_lines(port, *traffic);
  return {{"robot", DoctorLevel::Fail, port + ": " + traffic.error().message, traffic.error().hint}};
}

namespace {

constexpr const char* kMbotHowTo = "docs/howto/mbot.md";

/// Receives messages on all channels.
class MbotListener {
 public:
  Status listen(LcmLink& link, Duration most, const DoctorCancelled& cancelled) {
    if (Status status = link.subscribe(".*"); !status) return status;
    const Duration until = steady_now() + most;
    while (steady_now() < until && !cancelled()) {
      const auto message = link.next(std::min(kDoctorSlice, until - steady_now()));
      if (!message) return tl::unexpected(message.error());
      if (*message) receive(**message);
    }
    traffic_.listened_s = to_seconds(most);
    traffic_.there =
        channels_.empty() ? "nothing received" : fmt::format("received: {}", fmt::join(channels_, ", "));
    return {};
  }
  [[nodiscard]] const NetworkTraffic& traffic() const { return traffic_; }
  [[nodiscard]] bool simulated() const { return channels_.contains(kSimulatorChannel); }

 private:
  void receive(const LcmMessage& message) {
    channels_.insert(message.channel);
    if (message.channel == kDriverChannel) traffic_.driver = presence_of(message.payload);
    if (message.channel == traffic_.commands && mbot::decode<mbot::Twist2D>(message.payload))
      ++traffic_.others_commands;
    if (message.channel != traffic_.odometry) return;
    ++traffic_.odometries;
    const auto utime = mbot::utime_of(message.payload);
    if (!utime || *utime == 0) return;
    const double behind_s = 1e-6 * static_cast<double>(message.received_us - *utime);
    traffic_.behind_s = std::min(traffic_.behind_s.value_or(behind_s), behind_s);
  }

  NetworkTraffic traffic_{.odometry = "MBOT_ODOMETRY", .commands = "MBOT_VEL_CMD"};
  std::set<std::string> channels_{};
};

}  // namespace

std::vector<DoctorLine> check_mbot(const std::string& address, const DoctorCancelled& cancelled) {
  constexpr Duration kListenFor = std::chrono::milliseconds(1500);
  const auto link = open_lcm(address);
  MbotListener listener;
  const Status status = link ? listener.listen(**link, kListenFor, cancelled) : tl::unexpected(link.error());
  if (!status) return {{"robot", DoctorLevel::Fail, status.error().message, status.error().hint}};
  std::vector<DoctorLine> lines = network_lines(listener.traffic(), kMbotHowTo);
  if (listener.simulated()) lines.front().message += "; simulated";
  return lines;
}

namespace {

constexpr const char* kRos2HowTo = "docs/howto/ros2.md";

/// The first fields of sensor_msgs/msg/BatteryState.
struct BatteryBegin {
  static constexpr std::string_view kType = "sensor_msgs/msg/BatteryState";
  ros2::Header header{};
  float voltage = 0, temperature = 0, current = 0, charge = 0, capacity = 0, design_capacity = 0;
  float percentage = 0;  ///< from 0 to 1, or NaN if it is not measured
  WAYMARK_ROS2_FIELDS(self.header, self.voltage, self.temperature, self.current, self.charge, self.capacity,
                      self.design_capacity, self.percentage)
};

class Ros2Listener {
 public:
  Ros2Listener(Bus& bus, const Ros2Profile& profile) : bus_(bus), profile_(profile) {
    traffic_.odometry = profile.odometry_topic;
    traffic_.commands = profile.command_topic;
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
      if (message->subscription == *commands) receive_command(*message);
      if (message->subscription == *odometry) receive_odometry(*message);
      if (message->subscription == *battery) receive_battery(message->bytes);
    }
    traffic_.listened_s = to_seconds(most);
    name_drivers();
    const auto endpoints = bus_.endpoints();
    traffic_.has_subscriber = std::ranges::any_of(endpoints, [&](const BusEndpoint& endpoint) {
      return !endpoint.publishes && endpoint.name.topic == command_use(profile_).name.topic;
    });
    return {};
  }
  [[nodiscard]] NetworkTraffic& traffic() { return traffic_; }
  /// Fails if several robots are found, because a single command would move all of them.
  [[nodiscard]] std::vector<DoctorLine> robot_lines() const {
    if (robots_.size() < 2) return {};
    return {{"robots", DoctorLevel::Fail,
             fmt::format("{} programs publish odometry on {}. Are there two robots in this domain?",
                         robots_.size(), profile_.odometry_topic),
             "Use a ROS_DOMAIN_ID per robot, or a namespace and a profile with its topics."}};
  }

 private:
  void receive_command(const BusMessage& message) {
    ++traffic_.others_commands;
    drivers_.insert(message.identity.guid);
  }
  void name_drivers() {
    traffic_.driver = names_.of(drivers_, bus_);
    const std::set<Guid> all = publishers_of(command_use(profile_).name, bus_);
    traffic_.silent_publishers = static_cast<int>(all.size());
    traffic_.silent_names = names_.of(all, bus_);
  }
  void receive_odometry(const BusMessage& message) {
    const auto odometry = cdr::decode<ros2::Odometry>(message.bytes);
    if (!odometry) return;
    robots_.insert(message.identity.guid);
    ++traffic_.odometries;
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const Duration stamp = ros2::from_ros(odometry->header.stamp).time_since_epoch();
    const double behind_s = to_seconds(std::chrono::duration_cast<Duration>(now) - stamp);
    traffic_.behind_s = std::min(traffic_.behind_s.value_or(behind_s), behind_s);
  }
  void receive_battery(std::span<const std::uint8_t> bytes) {
    const auto battery = cdr::decode<BatteryBegin>(bytes);
    if (!battery) return;
    traffic_.battery_V = battery->voltage;
    if (battery->percentage >= 0 && battery->percentage <= 1) traffic_.battery_share = battery->percentage;
  }

  Bus& bus_;
  const Ros2Profile& profile_;
  NetworkTraffic traffic_{};
  PublisherNames names_{};
  std::set<Guid> robots_{};   ///< publishers of the received odometry
  std::set<Guid> drivers_{};  ///< publishers of the received commands
};

/// Errors in the profile's robot file that would prevent a drive.
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

/// The peers on the network, and the topics in the profile that cannot be received.
std::vector<DoctorLine> peer_lines(const Bus& bus, const BusOptions& options, const Ros2Profile& profile) {
  const bool alone = bus.participants().empty();
  std::vector<DoctorLine> lines = {{"peers", alone ? DoctorLevel::Fail : DoctorLevel::Ok,
                                    searched(options, bus),
                                    alone ? "echo $ROS_DOMAIN_ID, on both computers" : ""}};
  for (const std::string& words : mismatches(uses_of(profile), bus.endpoints()))
    lines.push_back({"qos", DoctorLevel::Fail, words, "docs/formats/ros2-profile.md"});
  if (lines.size() == 1 && !alone)
    lines.push_back(
        {"qos", DoctorLevel::Ok, "the qualities of service of all topics in the profile match", ""});
  if (!alone)
    for (const std::string& words : missing_publishers(profile, bus.endpoints()))
      lines.push_back({"topics", DoctorLevel::Fail, words, "waymark ros2 topic list"});
  return lines;
}

}  // namespace

std::vector<DoctorLine> check_ros2(const std::string& profile, const DoctorCancelled& cancelled) {
  constexpr Duration kListenFor = std::chrono::seconds(3);
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
  if (Status status = listener.listen(kListenFor, cancelled); !status) return failed(status.error());
  std::vector<DoctorLine> lines = network_lines(listener.traffic(), kRos2HowTo);
  for (DoctorLine& line : listener.robot_lines()) lines.push_back(std::move(line));
  for (DoctorLine& line : profile_lines(*found)) lines.push_back(std::move(line));
  for (DoctorLine& line : peer_lines(**bus, *options, *found)) lines.push_back(std::move(line));
  return lines;
}

namespace {

constexpr const char* kGazeboHowTo = "docs/howto/gazebo.md";

/// Arrival time and timestamp of a message.
struct Moment {
  Duration arrived{};
  SensorTime stamp{};
};

Result<NetworkTraffic> listen_to_gazebo(GazeboLink& link, const GazeboProfile& profile, Duration most,
                                        const DoctorCancelled& cancelled) {
  NetworkTraffic traffic{.odometry = profile.odometry_topic, .commands = profile.command_topic};
  const auto odometry = link.subscribe(profile.odometry_topic, 100);
  if (!odometry) return tl::unexpected(odometry.error());
  const auto commands = link.subscribe(profile.command_topic, 100);
  if (!commands) return tl::unexpected(commands.error());
  std::optional<Moment> first;
  Moment last;
  const Duration until = steady_now() + most;
  while (steady_now() < until && !cancelled()) {
    const auto message = link.next(std::min(kDoctorSlice, until - steady_now()));
    if (!message || !message->value) continue;
    traffic.others_commands += message->subscription == *commands ? 1 : 0;
    const auto* value = std::get_if<Odometry>(&*message->value);
    if (message->subscription != *odometry || value == nullptr) continue;
    ++traffic.odometries;
    last = {message->arrived, value->stamp};
    if (!first) first = last;
  }
  traffic.listened_s = to_seconds(most);
  if (first && last.arrived > first->arrived)
    traffic.sim_pace = to_seconds(last.stamp - first->stamp) / to_seconds(last.arrived - first->arrived);
  const std::vector<std::string> publishers = link.publishers(profile.command_topic);
  if (!publishers.empty())
    traffic.driver = traffic.silent_names = fmt::format("at {}", fmt::join(publishers, ", "));
  traffic.silent_publishers = static_cast<int>(publishers.size());
  if (traffic.odometries == 0) traffic.there = link.where() + "; " + topic_list_text(link.topics());
  return traffic;
}

}  // namespace

std::vector<DoctorLine> check_gazebo(const std::string& profile, const DoctorCancelled& cancelled) {
  constexpr Duration kListenFor = std::chrono::seconds(2);
  const auto found = find_gazebo_profile(profile);
  const auto link = found ? open_gazebo() : tl::unexpected(found.error());
  const auto traffic =
      link ? listen_to_gazebo(**link, *found, kListenFor, cancelled) : tl::unexpected(link.error());
  if (!traffic) return {{"robot", DoctorLevel::Fail, to_string(traffic.error()), kGazeboHowTo}};
  return network_lines(*traffic, kGazeboHowTo);
}

}  // namespace waymark
