#include "waymark/cli/setup_flags.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include "waymark/base/suggest.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/settings.hpp"
#include "waymark/live/robot_kinds.hpp"

namespace waymark::cli {
namespace {

/// sim and, with `processes`, each kind as KIND:ADDRESS.
std::vector<std::string> robot_names(bool processes) {
  std::vector<std::string> names = {"sim"};
  if (!processes) return names;
  for (const RobotKind& kind : robot_kinds()) names.push_back(fmt::format("{}:{}", kind.name, kind.address));
  return names;
}

std::string robot_help(bool processes) {
  std::string help = "Robot: sim (simulated)";
  if (!processes) return help;
  const auto kinds = robot_kinds();
  for (const RobotKind& kind : kinds)
    help += fmt::format("{}{}:{} ({})", &kind == &kinds.back() ? " or " : ", ", kind.name, kind.address,
                        kind.help);
  return help;
}

}  // namespace

SetupFlags::SetupFlags(CLI::App& app, const std::string& world, bool processes,
                       const std::string& robot_file_default)
    : app_(app), processes_(processes), world_(world) {
  app.add_option("--robot", robot_, robot_help(processes))->capture_default_str()->type_name("NAME");
  CLI::Option* world_flag = app.add_option("--world", world_,
                                           "World of the simulated robot: circuit24, limo-walls, "
                                           "academy-house, mbot-square, or the path of a .yaml file")
                                ->type_name("NAME");
  if (world.empty() && !processes) world_flag->required();
  if (!world.empty()) world_flag->capture_default_str();
  app.add_option(
         "--robot-file", robot_file_,
         fmt::format("Body, camera and behaviour of the robot: {}. Unless given: {}the robot that the "
                     "world names, or limo",
                     kRobotNames, robot_file_default))
      ->type_name("NAME");
  if (processes)
    app.add_option(
           "--camera-source", live_cameras_,
           "Camera of this computer that gives the pictures of a robot which sends none, with --robot "
           "process:CMD: v4l2:/dev/video0, or NAME=ADDRESS where the robot's file names several")
        ->type_name("ADDRESS")
        ->group(kMoreGroup);
  app.add_option("--seed", seed_, "Seed of all noise: the same seed gives the same bytes")
      ->capture_default_str()
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53, "INTEGER"))
      ->type_name("INTEGER");
}

Status SetupFlags::refuse_seed() const {
  return refuse_flag(app_, "--seed", "nothing is drawn at random for a robot that is a process",
                     "Leave it out; a simulated process takes a seed of its own.");
}

std::vector<std::string> SetupFlags::as_words() const {
  std::vector<std::string> words = {"--world", world_, "--seed", std::to_string(seed_)};
  if (!robot_file_.empty()) words.insert(words.end(), {"--robot-file", robot_file_});
  return words;
}

Status add_live_cameras(const std::vector<std::string>& words, RobotSetup& setup) {
  const std::vector<MountedCamera> cameras = setup.simulated.cameras();
  for (const std::string& word : words) {
    auto camera = parse_camera_address(word, cameras.front().name);
    if (!camera) {
      camera.error().place.key = "--camera-source";
      return tl::unexpected(camera.error());
    }
    if (std::ranges::find(cameras, camera->name, &MountedCamera::name) == cameras.end())
      return fail(ErrorCode::InvalidArgument, fmt::format("the robot has no camera '{}'", camera->name),
                  {.key = "--camera-source"}, "Name one of the cameras of its file.");
    setup.live_cameras.push_back(std::move(*camera));
  }
  return {};
}

Result<RobotSetup> SetupFlags::make(const std::string& robot_file) const {
  const std::string file = robot_file_.empty() ? robot_file : robot_file_;
  if (auto setup = processes_ ? load_kind(robot_, world_, file, seed_) : std::nullopt) {
    if (*setup)
      if (Status added = add_live_cameras(live_cameras_, **setup); !added)
        return tl::unexpected(added.error());
    return std::move(*setup);
  }
  if (!live_cameras_.empty())
    return fail(ErrorCode::InvalidArgument, "a simulated robot has simulated cameras",
                {.key = "--camera-source"}, "Leave it out, or give --robot process:CMD.");
  if (robot_ != "sim")
    return fail(ErrorCode::InvalidArgument, fmt::format("there is no robot '{}'", robot_), {.key = "--robot"},
                suggestion(robot_, robot_names(processes_)));
  if (lacks_world())
    return fail(ErrorCode::InvalidArgument, "--world is required: the simulated robot drives in one",
                {.key = "--world"}, "For example --world circuit24.");
  return load_setup(world_, file, seed_);
}

}  // namespace waymark::cli
