#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/mbot/mbot_robot.hpp"

namespace waymark::cli {
namespace {

ExitCode mbot_robot(const MbotRobotSettings& args, Console& console) {
  const auto address = lcm_address(args.address);
  if (!address) return fail_usage(address.error(), console);
  const auto robot = read_named_robot(args.robot_file);
  if (!robot) return fail_usage(robot.error(), console);
  MbotRobotOptions options{.address = *address, .bridge = {}, .share_commands = args.wire.shares()};
  options.bridge.robot = robot->model.name;
  options.bridge.tag_latency =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(args.tag_latency_s));
  const Status status = run_mbot_robot(options, standard_wire(console, args.wire.listen_only));
  return status ? ExitCode::Ok : console.failed(status.error(), ExitCode::SomeFailed);
}

Verb mbot_robot_verb() {
  return {
      .name = "robot",
      .sentence = "Run the process of an MBot; --robot mbot:ADDRESS starts it",
      .help =
          R"(Receives the messages of an MBot (mbot_lcm_base) on LCM and writes them as JSON lines to standard output; reads
commands from standard input and publishes them as MBOT_VEL_CMD (docs/formats/robot-process.md). `waymark teach
--robot mbot:` starts it behind its watchdog. Started alone, it shows whether robot data arrive. It sends its hello
after odometry has arrived, and no commands of another program for 0.4 s; earlier input is ignored.

Exit code: 0 its input ended, 1 no odometry within 12 s, another program commands the robot, or no
liblcm; 2 wrong usage.

Example:
  waymark mbot robot < /dev/null
)",
      .prepare = prepared_job(mbot_robot)};
}

}  // namespace

Verb mbot_verb() {
  return {.name = "mbot",
          .sentence = "Join the LCM network of an MBot",
          .help = "Example:\n  waymark mbot robot udpm://239.255.76.67:7667?ttl=1\n",
          .verbs = {mbot_robot_verb()}};
}

}  // namespace waymark::cli
