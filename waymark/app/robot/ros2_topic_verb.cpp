#include <functional>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/dds/discovery.hpp"
#include "waymark/robots/ros2/topic_tools.hpp"

namespace waymark::cli {
namespace {

struct TopicArgs {
  explicit TopicArgs(CLI::App& app) : network(app) {}

  Ros2Flags network;
  std::string topic{};
  WatchLimits limits{};
};

using TopicRun = Status (*)(const TopicArgs&, Bus&, Console&);

Status list(const TopicArgs& /*args*/, Bus& bus, Console& console) {
  wait_for_discovery(bus, WatchLimits().patience, interrupted);
  const auto topics = list_topics(bus.endpoints());
  for (const TopicListing& one : topics) console.print(to_text(one) + "\n");
  return topics.empty() ? fail(ErrorCode::NotFound, "no topic was found") : Status();
}

Status watch(const TopicArgs& args, Bus& bus, Console& console,
             const std::function<Status(const WatchedTopic&, const BusMessage&)>& take) {
  return watch_messages(
      bus, args.topic, args.limits, [&] { return interrupted() || console.output_ended(); }, take);
}

Status echo(const TopicArgs& args, Bus& bus, Console& console) {
  return watch(args, bus, console, [&](const WatchedTopic& topic, const BusMessage& message) -> Status {
    const auto text = message_text(topic.name.type, message.bytes);
    if (!text) return tl::unexpected(text.error());
    console.print(*text + "---\n");
    return {};
  });
}

Status hz(const TopicArgs& args, Bus& bus, Console& console) {
  RateCounter counter;
  Status status = watch(args, bus, console, [&](const WatchedTopic&, const BusMessage& message) -> Status {
    counter.add(message.arrived, message.bytes.size());
    console.live(counter.text());
    return {};
  });
  console.end_progress();
  if (status) console.print(counter.text() + "\n");
  return status;
}

Verb topic_verb(const char* name, const char* sentence, const char* help, TopicRun run, bool one_topic) {
  const auto prepare = [run, one_topic](CLI::App& app) -> Run {
    const auto args = std::make_shared<TopicArgs>(app);
    if (one_topic) {
      add_option(app, "topic TOPIC", args->topic, "Name of the topic, for example /odom", kRequired);
      add_fields(app, args->limits);
    }
    return [args, run](Console& console) {
      const auto options = args->network.options();
      if (!options) return fail_usage(options.error(), console);
      const auto bus = open_bus(*options);
      if (!bus) return console.failed(bus.error(), ExitCode::SomeFailed);
      const Status status = run(*args, **bus, console);
      if (status) return ExitCode::Ok;
      const Error& error = status.error();
      console.note(error);
      if (error.code == ErrorCode::NotFound && error.hint.empty()) console.note(searched(*options, **bus));
      return error.code == ErrorCode::InvalidArgument ? ExitCode::Usage : ExitCode::SomeFailed;
    };
  };
  return {.name = name, .sentence = sentence, .help = help, .prepare = prepare};
}

}  // namespace

Verb ros2_topic_verb() {
  return {
      .name = "topic",
      .sentence = "List the topics of a ROS 2 network, show messages, measure rates",
      .help = "Example:\n  waymark ros2 topic list\n",
      .verbs = {
          topic_verb("list", "List topics, their types, publishers and subscriptions",
                     "Exit code: 0 a topic was found, 1 none within 3 s, 2 wrong usage.\n\nExample:\n"
                     "  waymark ros2 topic list\n"
                     "  /odom [nav_msgs/msg/Odometry] 1 publisher (reliable), 0 subscriptions\n",
                     list, false),
          topic_verb("echo", "Show the messages of a topic, field by field",
                     "Exit code: 0 messages arrived, 1 none, or an unknown type, 2 wrong usage.\n\nExample:\n"
                     "  waymark ros2 topic echo /odom --count 1\n",
                     echo, true),
          topic_verb("hz", "Measure the rate of the messages of a topic",
                     "Exit code: 0 messages arrived, 1 none, 2 wrong usage.\n\nExample:\n"
                     "  waymark ros2 topic hz /camera/color/image_raw --seconds 5\n",
                     hz, true)}};
}

}  // namespace waymark::cli
