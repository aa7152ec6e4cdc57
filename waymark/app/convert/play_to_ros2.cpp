#include "waymark/app/convert/play_to_ros2.hpp"

#include <optional>
#include <utility>

#include "waymark/app/convert/play_log.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/dds/ros_environment.hpp"
#include "waymark/robots/ros2/log_publisher.hpp"
#include "waymark/robots/ros2/topic_tools.hpp"
#include "waymark/robots/ros2/velocity_commands.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

void note_omitted_topics(const LogPublisher& publisher, const JobControl& control) {
  for (const std::string& topic : publisher.left_out())
    control.note(
        topic +
        " is not published: velocity commands move a subscribed robot. Set `commands` to publish them");
  for (const std::string& topic : publisher.skipped_topics())
    control.note(topic + " was skipped: it is not a ROS topic");
}

}  // namespace

Ros2Played play_to_ros2(MessageLog& log, const LogSelection& selection, const Ros2PlayOptions& options,
                        const JobControl& control) {
  constexpr Duration kDiscovery = std::chrono::milliseconds(1500);
  constexpr Duration kReportInterval = std::chrono::seconds(1);
  BusOptions network;
  if (Status known = apply_ros_environment(network, process_environment()); !known) return {.status = known};
  std::optional<ZeroGuard> guard;
  if (options.commands) {
    auto started = ZeroGuard::start(network, control.note);
    if (!started) return {.status = tl::unexpected(started.error())};
    guard.emplace(std::move(*started));
  }
  const auto bus = open_bus(network);
  if (!bus) return {.status = tl::unexpected(bus.error())};
  wait_for_discovery(**bus, kDiscovery, control.cancelled);
  std::vector<LogChannel> channels = log.channels();
  std::erase_if(channels, [&](const LogChannel& one) { return !selection.takes(one.topic); });
  if (Status alone = check_no_other_publisher(channels, options.commands, **bus); !alone)
    return {.status = alone};
  LogPublisher publisher(**bus, options.commands, [&](const BusTopic& topic) {
    if (guard) guard->guard(topic);
  });
  const auto print_reports = [&] {
    for (const std::string& report : publisher.take_reports()) control.note(report);
  };
  Duration next_report{};
  const auto publish = [&](const LogChannel& channel, const LogMessage& message) {
    Status status = publisher.publish(channel, message);
    if (steady_now() < next_report) return status;
    next_report = steady_now() + kReportInterval;
    print_reports();
    return status;
  };
  Status status = publisher.publish_kept(log, selection);
  if (status) status = play_messages(log, selection, options.speed, publish, control.cancelled);
  const Status stopped = publisher.stop();
  print_reports();
  note_omitted_topics(publisher, control);
  return {.status = status ? stopped : status, .published = publisher.published()};
}

}  // namespace waymark
