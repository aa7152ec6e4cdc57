#include <algorithm>
#include <variant>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/doctor/doctor_network.hpp"
#include "waymark/robots/gazebo/gazebo_robot.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr const char* kGazeboHowTo = "docs/howto/gazebo.md";

/// When a message came, and its stamp.
struct Moment {
  Duration arrived{};
  SensorTime stamp{};
};

Result<NetworkHeard> listen_to_gazebo(GazeboLink& link, const GazeboProfile& profile, Duration most,
                                      const DoctorCancelled& cancelled) {
  NetworkHeard heard{.odometry = profile.odometry_topic, .commands = profile.command_topic};
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
    heard.others_commands += message->subscription == *commands ? 1 : 0;
    const auto* value = std::get_if<Odometry>(&*message->value);
    if (message->subscription != *odometry || value == nullptr) continue;
    ++heard.odometries;
    last = {message->arrived, value->stamp};
    if (!first) first = last;
  }
  heard.listened_s = to_seconds(most);
  if (first && last.arrived > first->arrived)
    heard.sim_pace = to_seconds(last.stamp - first->stamp) / to_seconds(last.arrived - first->arrived);
  const std::vector<std::string> publishers = link.publishers(profile.command_topic);
  if (!publishers.empty())
    heard.driver = heard.silent_names = fmt::format("at {}", fmt::join(publishers, ", "));
  heard.silent_publishers = static_cast<int>(publishers.size());
  if (heard.odometries == 0) heard.there = link.where() + "; " + topics_in_words(link.topics());
  return heard;
}

}  // namespace

std::vector<DoctorLine> check_gazebo(const std::string& profile, const DoctorCancelled& cancelled) {
  constexpr Duration kListen = std::chrono::seconds(2);
  const auto found = find_gazebo_profile(profile);
  const auto link = found ? open_gazebo() : tl::unexpected(found.error());
  const auto heard =
      link ? listen_to_gazebo(**link, *found, kListen, cancelled) : tl::unexpected(link.error());
  if (!heard) return {{"robot", DoctorLevel::Fail, to_string(heard.error()), kGazeboHowTo}};
  return network_lines(*heard, kGazeboHowTo);
}

}  // namespace waymark
