#include "waymark/cli/run_args.hpp"

#include <utility>

#include "waymark/cli/flags.hpp"
#include "waymark/live/own_robot.hpp"
#include "waymark/live/start_recording.hpp"

namespace waymark::cli {
namespace {

/// Flags that have no effect with this robot and this driver.
Status check_effects(const RunArgs& args, const RobotSetup& setup) {
  const bool process = !setup.process.empty();
  Status status;
  if (process)
    status = refuse_flag(args.app, "--images", "a robot that is a process sends pictures or does not",
                         "Leave it out.");
  if (status && (process || !args.live.view))
    status = refuse_flag(args.app, "--pace", "only a simulated robot that is watched keeps a pace",
                         "Add --view, and let the robot be simulated, or leave it out.");
  if (status && args.job.driver == "lines")
    status = refuse_flag(args.app, "--speed-m-s", "the lines themselves say how fast", "Leave it out.");
  if (status && !process && !args.images && !args.job.images.empty())
    status = fail(ErrorCode::InvalidArgument, "there are no pictures to record", {.key = "--record-images"},
                  "Add --images.");
  if (status && process && args.job.driver != "scripted" && args.job.driver != "page" && !args.live.view)
    status = args.setup.refuse_seed();
  return status;
}

}  // namespace

Result<RobotSetup> RunArgs::make_setup() const {
  Result<RobotSetup> made = setup.make();
  if (!made) return made;
  std::optional<DetectingCameraOptions> pictures;  // of the robot's own process
  Status usable = check_effects(*this, *made);
  if (usable) usable = scene.apply(images, pictures);
  if (!usable) return tl::unexpected(usable.error());
  // A script does not care how fast the time passes; a person does, also one who only watches.
  const SimulatedTime time{.lockstep = job.driver == "scripted" || live.view, .pace = live.view ? pace : 0};
  std::vector<std::string> words = setup.as_words();
  if (images) words.emplace_back("--images");
  for (std::string& word : scene.as_words()) words.push_back(std::move(word));
  Status status = made->process.empty() ? become_the_robot(*made, std::move(words), time) : Status();
  if (status) status = place_lone_anchor(*made, anchor, job.map);
  if (!status) return tl::unexpected(status.error());
  return made;
}

void RunArgs::add_to(CLI::App& verb) {
  add_option(verb, "-o,--output FOLDER", folder, "Folder for what is written: lap.mcap, map/, replay.mcap",
             kRequired);
  driver = verb.add_option(
      "--driver", job.driver,
      "Source of the operator's commands: gamepad, keyboard, lines (go, stop, quit and drive 0.3 -0.1 on "
      "standard input), scripted (with --world) or page (with --view, and then the default)");
  driver->capture_default_str()->type_name("NAME");
  add_option(verb, "--map FOLDER", job.map, "Folder of an existing map, which makes teaching unnecessary");
  add_option(verb, "--route NAME", job.replay.route, "With --map: a route of that name (`waymark routes`)",
             kMore);
  add_option(verb, "--record-images HOW", job.images,
             "Also record the pictures, of laps and replays: jpeg, or raw, ten times as large",
             one_of({"jpeg", "raw"}), kMore);
  add_option(verb, "--calibration FILE", calibration,
             "Calibration of this robot (calibration.yaml), also the initial values of what replays learn",
             kMore);
  add_option(verb, "--speed-m-s FLOAT", job.speed_m_s, "Speed at full forward deflection of the stick",
             kShown, between(0.01, 5.0));
  add_option(verb, "--laps NUMBER", job.replay.replay.laps, "Number of laps of a closed route", kShown,
             between(0.01, 1000.0));
  verb.add_flag("--images", images, "Let the simulated robot send pictures");
  add_option(verb, "--pace FLOAT", pace,
             "Real-time factor with --view and a simulated robot: simulated seconds per second; 0: as fast "
             "as possible",
             between(0.0, 100.0), kShown, kMore);
  add_flags(verb, anchor);
  verb.add_flag("--json", json, "One JSON object instead of words");
}

}  // namespace waymark::cli
