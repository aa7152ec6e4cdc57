#include "waymark/app/live/robot_setup.hpp"

#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/faults_file.hpp"
#include "waymark/config/yaml/world_file.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 22U;

/// Path and content of a file that was found.
struct Found {
  std::string path;
  std::string text;
};

Result<Found> find(const char* folder, const std::string& name, FileUse use) {
  const auto path = find_shared(folder, name);
  if (!path) return tl::unexpected(path.error());
  const auto text = or_wrong_kind(read_text_file(*path, kMaxFileBytes), *path, use);
  if (!text) return tl::unexpected(text.error());
  return Found{path->string(), *text};
}

/// The robot specified by the user, else the one named in the world, else the default.
Result<std::string> name_of_robot(const std::string& robot_file, const Found& world_file) {
  constexpr const char* kDefaultRobot = "limo";
  if (!robot_file.empty()) return robot_file;
  if (world_file.text.empty()) return kDefaultRobot;
  Result<std::string> of_world = robot_of_world(world_file.text, world_file.path);
  if (of_world && of_world->empty()) return kDefaultRobot;
  return of_world;
}

SimulatedRobotOptions with_seed(SimulatedRobotOptions options, std::uint64_t seed) {
  options.seed = seed;
  return options;
}

}  // namespace

Result<RobotSetup> load_setup(const std::string& world_name, const std::string& robot_file,
                              std::uint64_t seed) {
  Result<Found> world_file = world_name.empty() ? Found() : find("worlds", world_name, FileUse::World);
  if (!world_file) return tl::unexpected(world_file.error());
  Result<World> world = world_name.empty() ? World()
                                           : or_wrong_kind(parse_world(world_file->text, world_file->path),
                                                           world_file->path, FileUse::World);
  if (!world) return tl::unexpected(world.error());
  const Result<std::string> robot_name = name_of_robot(robot_file, *world_file);
  if (!robot_name) return tl::unexpected(robot_name.error());
  const Result<Found> robot_text = find("robots", *robot_name, FileUse::Robot);
  if (!robot_text) {
    Error error = robot_text.error();
    if (robot_file.empty() && error.place.source.empty()) error.place = {world_file->path, {}, {}, "robot"};
    return tl::unexpected(std::move(error));
  }
  const auto robot =
      or_wrong_kind(parse_robot(robot_text->text, robot_text->path), robot_text->path, FileUse::Robot);
  if (!robot) return tl::unexpected(robot.error());
  return RobotSetup{.simulated = {.world = std::move(*world),
                                  .model = robot->model,
                                  .camera = robot->camera,
                                  .robot = with_seed(robot->simulation, seed),
                                  .camera_name = robot->camera_name,
                                  .more_cameras = robot->more_cameras},
                    .world_yaml = world_file->text,
                    .robot_yaml = robot_text->text,
                    .robot_path = robot_text->path,
                    .commissioned = robot->commissioned};
}

std::string robot_file_in(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "robot.yaml";
  std::error_code ignored;
  return std::filesystem::exists(file, ignored) ? file.string() : std::string();
}

Status apply_simulation(const SimulationRequest& request, const GivenFields& given, RobotSetup& setup) {
  FieldRefusals refused(given);
  refused.fields(!setup.process.empty(), {"images", "threads", "faults"}, "applies only to a simulated robot",
                 "Omit this option, or omit `robot=process:CMD`.");
  refused.fields(!request.images, {"threads"}, "has no effect without images",
                 "Add `images`, or omit `threads`.");
  if (!refused.status()) return refused.status();
  setup.simulated.threads = request.threads;
  if (request.faults.empty()) return {};
  auto faults =
      or_wrong_kind(read_faults(request.faults, setup.simulated.world), request.faults, FileUse::Faults);
  if (!faults) return tl::unexpected(faults.error());
  setup.simulated.robot.faults = std::move(*faults);
  return {};
}

void refuse_seed(bool when, FieldRefusals& refused) {
  refused.fields(when, {"seed"}, "has no effect on a robot process",
                 "Omit `seed`; a simulated robot process has its own seed.");
}

Result<RobotCommand> own_program(std::vector<std::string> words) {
  std::error_code error;
  const std::string self = std::filesystem::read_symlink("/proc/self/exe", error).string();
  if (error) return fail(ErrorCode::Unsupported, "cannot find the path of this program: " + error.message());
  words.insert(words.begin(), self);
  return RobotCommand(std::move(words));
}

Status become_the_robot(RobotSetup& setup, std::vector<std::string> words, const SimulatedTime& time) {
  words.insert(words.begin(), "robot-sim");
  if (time.lockstep) words.emplace_back("--lockstep");
  if (time.lockstep && time.pace > 0) words.insert(words.end(), {"--pace", fmt::format("{}", time.pace)});
  auto process = own_program(std::move(words));
  if (!process) return tl::unexpected(process.error());
  setup.process = std::move(*process);
  return {};
}

}  // namespace waymark
