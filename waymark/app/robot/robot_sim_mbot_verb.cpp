#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_sim_flags.hpp"

namespace waymark::cli {
namespace {

struct MbotSimArgs {
  explicit MbotSimArgs(CLI::App& verb) : flags(verb, PlantFlag::Shown, Images::Never) {
    add_fields(verb, options);
  }

  RobotSimFlags flags;
  MbotSimOptions options{};
};

ExitCode run_mbot(const MbotSimArgs& args, Console& console) {
  return args.flags.run(SimWire(args.options), console);
}

}  // namespace

Verb robot_sim_mbot_verb() {
  return {
      .name = "mbot",
      .sentence = "Simulate an MBot on LCM",
      .help =
          R"(Publishes the channels of an MBot (mbot_lcm_base) on LCM and obeys MBOT_VEL_CMD, in real time, until Ctrl-C: for --robot
mbot:ADDRESS (docs/howto/mbot.md). An MBot sends tag poses over LCM, not images, so there is no --images. TRUE_POSE
is the ground truth.
Exit code: 0 ended by Ctrl-C, 1 another MBot uses that address, or no liblcm, 2 wrong usage.

Examples:
  waymark robot-sim mbot --world mbot-square
  waymark robot-sim mbot udpm://239.255.76.67:7667?ttl=0 --world mbot-square --mbot-generation pi5
)",
      .prepare = prepared(run_mbot)};
}

}  // namespace waymark::cli
