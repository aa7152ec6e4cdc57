#include "waymark/cli/run_args.hpp"

#include <filesystem>
#include <utility>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include "waymark/config/map_file.hpp"
#include "waymark/live/own_robot.hpp"
#include "waymark/live/start_recording.hpp"

namespace waymark::cli {
namespace {

/// The tags of the place by the flags, or by the map that is there already. What is wrong with that map is
/// said where it is read.
Status know_tags(const RunArgs& args, RobotSetup& setup) {
  const bool told = !args.anchor.anchor.empty() || args.anchor.tag_size_m != 0;
  if (args.job.map.empty() || !setup.world_yaml.empty() || told) return check_live_setup(setup, args.anchor);
  const Result<MapFile> map = read_map(std::filesystem::path(args.job.map) / "map.yaml");
  if (map) place_lone_anchor(setup.simulated.world, map->anchor, map->tags.tags.at(map->anchor).size_m);
  return {};
}

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
  std::optional<DetectingCameraOptions> eye;  // of the robot's own process
  Status usable = check_effects(*this, *made);
  if (usable) usable = scene.apply(images, eye);
  if (!usable) return tl::unexpected(usable.error());
  // A script does not care how fast the time passes; a person does, also one who only watches.
  const SimulatedTime time{.lockstep = job.driver == "scripted" || live.view, .pace = live.view ? pace : 0};
  std::vector<std::string> words = setup.as_words();
  if (images) words.emplace_back("--images");
  for (std::string& word : scene.as_words()) words.push_back(std::move(word));
  Status status = made->process.empty() ? become_the_robot(*made, std::move(words), time) : Status();
  if (status) status = know_tags(*this, *made);
  if (!status) return tl::unexpected(status.error());
  return made;
}

void RunArgs::add_to(CLI::App& verb) {
  verb.add_option("-o,--output", folder, "Folder for what is written: lap.mcap, map/, replay.mcap")
      ->required()
      ->type_name("FOLDER");
  driver = verb.add_option(
      "--driver", job.driver,
      "Source of the operator's commands: gamepad, keyboard, lines (go, stop, quit and drive 0.3 -0.1 on "
      "standard input), scripted (with --world) or page (with --view, and then the default)");
  driver->capture_default_str()->type_name("NAME");
  verb.add_option("--map", job.map, "Folder of an existing map, which makes teaching unnecessary")
      ->type_name("FOLDER");
  verb.add_option("--route", job.replay.route, "With --map: a route of that name (`waymark routes`)")
      ->type_name("NAME")
      ->group(kMoreGroup);
  verb.add_option("--record-images", job.images,
                  "Also record the pictures, of laps and replays: jpeg, or raw, ten times as large")
      ->check(CLI::IsMember({"jpeg", "raw"}))
      ->type_name("HOW")
      ->group(kMoreGroup);
  verb.add_option(
          "--calibration", calibration,
          "Calibration of this robot (calibration.yaml), also the initial values of what replays learn")
      ->type_name("FILE")
      ->group(kMoreGroup);
  verb.add_option("--speed-m-s", job.speed_m_s, "Speed at full forward deflection of the stick")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 5.0))
      ->type_name("FLOAT");
  verb.add_option("--laps", job.replay.replay.laps, "Number of laps of a closed route")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1000.0))
      ->type_name("NUMBER");
  verb.add_flag("--images", images, "Let the simulated robot send pictures");
  verb.add_option("--pace", pace,
                  "Real-time factor with --view and a simulated robot: simulated seconds per second; 0: as "
                  "fast as possible")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str()
      ->type_name("FLOAT")
      ->group(kMoreGroup);
  add_flags(verb, anchor);
  verb.add_flag("--json", json, "One JSON object instead of words");
}

}  // namespace waymark::cli
