#include <cmath>
#include <functional>

#include "waymark/cli/parts.hpp"
#include "waymark/cli/ros2_flags.hpp"
#include "waymark/drivers/dds/discovery.hpp"
#include "waymark/drivers/dds/open_bus.hpp"
#include "waymark/drivers/dds/ros_names.hpp"
#include "waymark/drivers/ros2/message_text.hpp"
#include "waymark/drivers/ros2/topic_tools.hpp"
#include "waymark/drivers/watchdog/pipes.hpp"

namespace waymark::cli {
namespace {

constexpr Duration kTopicPatience = std::chrono::seconds(3);

struct TopicArgs {
  explicit TopicArgs(CLI::App& app) : network(app) {}

  Ros2Flags network;
  std::string topic{};
  int count = 0;
  double seconds = 0;
};

using TopicRun = ExitCode (*)(const TopicArgs&, Bus&, const BusOptions&, Console&);

ExitCode list(const TopicArgs& /*args*/, Bus& bus, const BusOptions& options, Console& console) {
  wait_for_discovery(bus, kTopicPatience, interrupted);
  const auto topics = list_topics(bus.endpoints());
  for (const TopicListing& one : topics)
    console.print(fmt::format("{} [{}] {} publisher{}{}, {} subscription{}\n", one.topic, one.type,
                              one.publishers, one.publishers == 1 ? "" : "s",
                              one.offered.empty() ? "" : " (" + one.offered + ")", one.subscriptions,
                              one.subscriptions == 1 ? "" : "s"));
  if (!topics.empty()) return ExitCode::Ok;
  console.say(searched(options, bus));
  return ExitCode::SomeFailed;
}

/// Calls `take` for each message of the topic until it says that it has enough.
ExitCode watch(const TopicArgs& args, Bus& bus, const BusOptions& options, Console& console,
               const std::function<bool(const WatchedTopic&, const BusMessage&)>& take) {
  const auto topic = watch_topic(bus, args.topic, kTopicPatience, interrupted);
  if (!topic) {
    console.say(topic.error());
    console.say(searched(options, bus));
    return ExitCode::SomeFailed;
  }
  const Duration began = steady_now();
  int count = 0;
  constexpr Duration kSlice = std::chrono::milliseconds(50);
  while (!interrupted() && !console.output_ended()) {
    if (args.seconds > 0 && to_seconds(steady_now() - began) > args.seconds) break;
    const auto message = bus.next(kSlice);
    if (!message) continue;
    if (!take(*topic, *message)) return ExitCode::SomeFailed;
    if (++count == args.count) break;
  }
  if (count > 0) return ExitCode::Ok;
  console.say("no message came on " + topic->name.topic);
  return ExitCode::SomeFailed;
}

ExitCode echo(const TopicArgs& args, Bus& bus, const BusOptions& options, Console& console) {
  return watch(args, bus, options, console, [&](const WatchedTopic& topic, const BusMessage& message) {
    const auto text = message_text(topic.name.type, message.bytes);
    if (!text) {
      console.say(text.error());
      return false;
    }
    console.print(*text + "---\n");
    return true;
  });
}

ExitCode hz(const TopicArgs& args, Bus& bus, const BusOptions& options, Console& console) {
  RateCounter counter;
  Duration next = steady_now() + std::chrono::seconds(1);
  const ExitCode code =
      watch(args, bus, options, console, [&](const WatchedTopic&, const BusMessage& message) {
        counter.add(message.arrived, message.bytes.size());
        if (steady_now() >= next) console.live(counter.text());
        if (steady_now() >= next) next += std::chrono::seconds(1);
        return true;
      });
  console.end_progress();
  if (code == ExitCode::Ok) console.print(counter.text() + "\n");
  return code;
}

Verb topic_verb(const char* name, const char* sentence, const char* help, TopicRun run, bool one_topic) {
  const auto prepare = [run, one_topic](CLI::App& app) -> Run {
    const auto args = std::make_shared<TopicArgs>(app);
    if (one_topic) {
      add_option(app, "topic TOPIC", args->topic, "Name of the topic, for example /odom", kRequired);
      add_option(app, "--count INTEGER", args->count, "End after so many messages; 0: go on until Ctrl-C",
                 between(0, 1'000'000'000));
      add_option(app, "--seconds FLOAT", args->seconds, "End after so long; 0: go on until Ctrl-C",
                 between(0.0, 1e9));
    }
    return [args, run, one_topic](Console& console) {
      if (one_topic && !is_topic_name(args->topic))
        return console.failed({.code = ErrorCode::InvalidArgument,
                               .message = fmt::format("'{}' is no name of a topic", args->topic),
                               .place = {.key = "topic"},
                               .hint = "`waymark ros2 topic list` shows those there are."},
                              ExitCode::Usage);
      const auto options = args->network.options();
      if (!options) return console.failed(options.error(), ExitCode::Usage);
      const auto bus = open_bus(*options);
      if (!bus) return console.failed(bus.error(), ExitCode::SomeFailed);
      return run(*args, **bus, *options, console);
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
                     "Exit code: 0 some topic was found, 1 none within 3 s, 2 wrong usage.\n\nExample:\n"
                     "  waymark ros2 topic list\n"
                     "  /odom [nav_msgs/msg/Odometry] 1 publisher (reliable), 0 subscriptions\n",
                     list, false),
          topic_verb("echo", "Show the messages of a topic, field by field",
                     "Exit code: 0 messages came, 1 none or of an unknown type, 2 wrong usage.\n\nExample:\n"
                     "  waymark ros2 topic echo /odom --count 1\n",
                     echo, true),
          topic_verb("hz", "Measure how often messages of a topic come",
                     "Exit code: 0 messages came, 1 none, 2 wrong usage.\n\nExample:\n"
                     "  waymark ros2 topic hz /camera/color/image_raw --seconds 5\n",
                     hz, true)}};
}

}  // namespace waymark::cli
