#include "waymark/app/live/robot_kinds.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/live/robot_setup.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/robots/gazebo/profile.hpp"
#include "waymark/robots/mbot/lcm_link.hpp"
#include "waymark/robots/ros2/profile.hpp"

namespace waymark {
namespace {

Result<RobotStart> start_command(const std::string& command, const std::string& robot_file) {
  if (command.empty())
    return fail(ErrorCode::InvalidArgument, "no command after `process:`", {.key = "robot"},
                "For example `robot=\"process:python3 my_robot.py\"`.");
  return RobotStart{robot_file, command};
}

/// Starts this program as the robot process.
Result<RobotStart> start_own(std::vector<std::string> words, const std::string& robot_file) {
  words.insert(words.end(), {"--robot-file", robot_file});
  auto process = own_program(std::move(words));
  if (!process) return tl::unexpected(process.error());
  return RobotStart{robot_file, std::move(*process)};
}

Result<RobotStart> start_ros2(const std::string& profile, const std::string& robot_file) {
  const auto found = find_ros2_profile(profile);
  if (!found) return tl::unexpected(found.error());
  if (const auto network = network_of(*found, "waymark"); !network) return tl::unexpected(network.error());
  auto start = start_own({"ros2", "robot", profile}, robot_file.empty() ? found->robot : robot_file);
  if (start) start->topics = digest_of(found->text);
  return start;
}

Result<RobotStart> start_limo(const std::string& port, const std::string& robot_file) {
  if (port.empty())
    return fail(ErrorCode::InvalidArgument, "no serial port after `limo:`", {.key = "robot"},
                "For example `robot=limo:/dev/ttyTHS1`.");
  return start_own({"limo", "robot", port}, robot_file.empty() ? "limo" : robot_file);
}

Result<RobotStart> start_mbot(const std::string& address, const std::string& robot_file) {
  const auto checked = lcm_address(address);
  if (!checked) return tl::unexpected(checked.error());
  return start_own({"mbot", "robot", *checked}, robot_file.empty() ? "mbot" : robot_file);
}

Result<RobotStart> start_gazebo(const std::string& profile, const std::string& robot_file) {
  const auto found = find_gazebo_profile(profile);
  if (!found) return tl::unexpected(found.error());
  return start_own({"gazebo", "robot", profile}, robot_file.empty() ? found->robot : robot_file);
}

constexpr std::array kKinds = {
    RobotKind{"process", "CMD", "a program that drives the robot, docs/formats/robot-process.md",
              start_command},
    RobotKind{"ros2", "PROFILE", "limo, turtlebot3, or a .yaml file: docs/howto/ros2.md", start_ros2},
    RobotKind{"limo", "PORT", "the serial port of AgileX LIMO: docs/howto/limo.md", start_limo},
    RobotKind{"mbot", "ADDRESS",
              "an MBot on LCM, by default udpm://239.255.76.67:7667?ttl=0: docs/howto/mbot.md", start_mbot},
    RobotKind{"gazebo", "PROFILE", "limo, or a .yaml file: docs/howto/gazebo.md", start_gazebo},
};

}  // namespace

std::span<const RobotKind> robot_kinds() { return kKinds; }

bool is_robot_kind(std::string_view word) {
  return std::ranges::any_of(kKinds, [word](const RobotKind& kind) {
    return word.starts_with(kind.name) && word.substr(kind.name.size()).starts_with(':');
  });
}

std::optional<Result<RobotSetup>> load_kind(const std::string& robot, const std::string& world,
                                            const std::string& robot_file, std::uint64_t seed) {
  for (const RobotKind& kind : kKinds) {
    const std::string begin = std::string(kind.name) + ":";
    if (!robot.starts_with(begin)) continue;
    const auto start = kind.start(robot.substr(begin.size()), robot_file);
    if (!start) {
      Error error = start.error();
      if (error.place.source.empty()) error.place.key = "robot";
      return tl::unexpected(std::move(error));
    }
    Result<RobotSetup> setup = load_setup(world, start->robot_file, seed);
    if (setup) {
      setup->process = start->process;
      setup->ground = {.robot = robot, .topics = start->topics};
      const auto by_default = kind.start(robot.substr(begin.size()), "");
      if (by_default && by_default->robot_file != start->robot_file)
        setup->usual_robot_file = by_default->robot_file;
    }
    return setup;
  }
  return std::nullopt;
}

Result<RobotSetup> load_robot(const std::string& robot, const std::string& world,
                              const std::string& robot_file, std::uint64_t seed, bool processes) {
  if (processes && is_robot_kind(robot)) return *load_kind(robot, world, robot_file, seed);
  if (robot != "sim")
    return fail(ErrorCode::InvalidArgument, fmt::format("unknown robot '{}'", robot), {.key = "robot"},
                suggestion(robot, robot_kind_names(processes)));
  if (world.empty())
    return fail(ErrorCode::InvalidArgument, "`world` is required for the simulated robot", {.key = "world"},
                "For example `world=circuit24`.");
  return load_setup(world, robot_file, seed);
}

std::vector<std::string> robot_kind_names(bool processes) {
  std::vector<std::string> names = {"sim"};
  if (!processes) return names;
  for (const RobotKind& kind : robot_kinds()) names.push_back(fmt::format("{}:{}", kind.name, kind.address));
  return names;
}

std::string robot_kinds_help(bool processes) {
  std::string help = "Robot: sim (simulated)";
  if (!processes) return help;
  const auto kinds = robot_kinds();
  for (const RobotKind& kind : kinds)
    help += fmt::format("{}{}:{} ({})", &kind == &kinds.back() ? " or " : ", ", kind.name, kind.address,
                        kind.help);
  return help;
}

Status add_live_cameras(const std::vector<std::string>& words, RobotSetup& setup) {
  const std::vector<MountedCamera> cameras = setup.simulated.cameras();
  for (const std::string& word : words) {
    auto camera = parse_camera_address(word, cameras.front().name);
    if (!camera) {
      camera.error().place.key = "camera_source";
      return tl::unexpected(camera.error());
    }
    if (std::ranges::find(cameras, camera->name, &MountedCamera::name) == cameras.end())
      return fail(ErrorCode::InvalidArgument, fmt::format("the robot has no camera '{}'", camera->name),
                  {.key = "camera_source"}, "Use the name of a camera in the robot file.");
    setup.live_cameras.push_back(std::move(*camera));
  }
  return {};
}

bool finds_tags_itself(const std::string& robot) {
  constexpr std::string_view kRos2 = "ros2:";
  if (robot.starts_with("mbot:")) return true;
  if (!robot.starts_with(kRos2)) return false;
  const auto profile = find_ros2_profile(robot.substr(kRos2.size()));
  return profile && !profile->detections_topic.empty();
}

std::vector<std::string> RobotRequest::as_words() const {
  std::vector<std::string> words = {"--world", world, "--seed", std::to_string(seed)};
  if (!robot_file.empty()) words.insert(words.end(), {"--robot-file", robot_file});
  return words;
}

Result<RobotSetup> requested_setup(const RobotRequest& request, bool processes, const std::string& robot_file,
                                   const GivenFields& given) {
  const bool process = processes && is_robot_kind(request.robot);
  const char* hint = "Omit this option, or use `robot=process:CMD`.";
  FieldRefusals refused(given);
  refused.fields(!process, {"detector", "search_every", "search_strips"},
                 "has no effect on the detection of a simulated robot", hint);
  refused.fields(!process, {"camera_source"}, "a simulated robot has simulated cameras", hint);
  refused.fields(process && !given("search_every"), {"search_strips"}, kSearchedWholly, kSearchEvery);
  if (!refused.status()) return tl::unexpected(refused.status().error());
  const std::string& file = request.robot_file.empty() ? robot_file : request.robot_file;
  Result<RobotSetup> setup = load_robot(request.robot, request.world, file, request.seed, processes);
  if (!setup || !process) return setup;
  setup->image_settings = request.image_settings;
  if (Status added = add_live_cameras(request.camera_sources, *setup); !added)
    return tl::unexpected(added.error());
  return setup;
}

}  // namespace waymark
