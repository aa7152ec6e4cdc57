#include <memory>
#include <string>

#include <CLI/App.hpp>

#include "waymark/cli/standard_wire.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/config/share.hpp"
#include "waymark/drivers/mbot/mbot_robot.hpp"

namespace waymark::cli {
namespace {

struct MbotRobotArgs {
  std::string address = kLcmDefaultAddress;
  std::string robot_file = "mbot";
  double tag_latency_s = to_seconds(MbotBridgeOptions{}.tag_latency);
  bool share_commands = false;
  bool listen_only = false;
};

ExitCode mbot_robot(const MbotRobotArgs& args, Console& console) {
  const auto address = lcm_address(args.address);
  if (!address) return console.failed(address.error(), ExitCode::Usage);
  const auto path = find_shared("robots", args.robot_file);
  const auto robot = path ? read_robot(*path) : tl::unexpected(path.error());
  if (!robot) return console.failed(robot.error(), ExitCode::Usage);
  MbotRobotOptions options{
      .address = *address, .bridge = {}, .share_commands = args.share_commands || args.listen_only};
  options.bridge.robot = robot->model.name;
  options.bridge.tag_latency =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(args.tag_latency_s));
  const Status status = run_mbot_robot(options, standard_wire(console, args.listen_only));
  return status ? ExitCode::Ok : console.failed(status.error(), ExitCode::SomeFailed);
}

Run prepare_mbot_robot(CLI::App& app) {
  const auto args = std::make_shared<MbotRobotArgs>();
  app.add_option("address", args->address, "Address of the robot's LCM network; ttl=1: beyond this machine")
      ->capture_default_str()
      ->type_name("ADDRESS");
  app.add_option("--robot-file", args->robot_file, "Body and camera of the robot")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option("--tag-latency-s", args->tag_latency_s,
                 "Time from the exposure of a picture to the stamp of its tags [s]")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->type_name("FLOAT");
  add_share_commands_flag(app, args->share_commands);
  add_listen_flag(app, args->listen_only);
  return [args](Console& console) { return mbot_robot(*args, console); };
}

Verb mbot_robot_verb() {
  return {
      .name = "robot",
      .sentence = "Be the process of an MBot: what --robot mbot:ADDRESS starts",
      .help =
          R"(Hears the messages of an MBot (mbot_lcm_base) on LCM and writes what comes as JSON lines on standard output; reads
commands from standard input and publishes them as MBOT_VEL_CMD (docs/formats/robot-process.md). `waymark teach
--robot mbot:` starts it behind its watchdog. Alone it shows whether a robot is heard.

The hello comes when odometry was heard and no commands of another program for 0.4 s; the input counts from then on.

Exit code: 0 its input ended, 1 no odometry within 12 s, another program commands the robot, or no
liblcm; 2 wrong usage.

Example:
  waymark mbot robot < /dev/null
)",
      .prepare = prepare_mbot_robot,
      .verbs = {}};
}

}  // namespace

Verb mbot_verb() {
  return {.name = "mbot",
          .sentence = "Join the LCM network of an MBot",
          .help = "Example:\n  waymark mbot robot udpm://239.255.76.67:7667?ttl=1\n",
          .prepare = {},
          .verbs = {mbot_robot_verb()}};
}

}  // namespace waymark::cli
