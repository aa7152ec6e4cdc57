#include "waymark/app/cli/robot_flags.hpp"

#include <algorithm>
#include <cstdio>
#include <string>
#include <thread>
#include <utility>

#include <unistd.h>

#include <fmt/format.h>

#include "waymark/config/share.hpp"

namespace waymark::cli {

Ros2Flags::Ros2Flags(CLI::App& app) : app_(app) { add_fields(app, place_); }

Status Ros2Flags::refuse_all(const std::string& why, const std::string& hint) const {
  Refusals refused(app_);
  refused.fields(true, {"domain", "localhost", "interface", "ros_distro"}, why, hint);
  return refused.status();
}

Result<BusOptions> Ros2Flags::options(const std::string& node, const std::string& usual_distro) const {
  RosPlace place = place_;
  if (place.distro.empty()) place.distro = usual_distro;
  return bus_options(place, node, process_environment());
}

SetupFlags::SetupFlags(CLI::App& app, const std::string& world, bool processes,
                       const std::string& robot_file_default)
    : app_(app), processes_(processes) {
  request_.world = world;
  add_option(app, "--robot NAME", request_.robot, robot_kinds_help(processes), kShown);
  CLI::Option* world_flag = add_option(app, "--world NAME", request_.world,
                                       fmt::format("World of the simulated robot: {}", kWorldNames));
  if (world.empty() && !processes) world_flag->required();
  if (!world.empty()) world_flag->capture_default_str();
  add_option(app, "--robot-file NAME", request_.robot_file,
             fmt::format("Body, camera and behaviour of the robot: {}. Default: {}the robot that the "
                         "world names, or limo",
                         kRobotNames, robot_file_default));
  if (processes)
    add_option(app, "--camera-source ADDRESS", request_.camera_sources,
               "Camera of this computer for a robot that sends no images, with --robot "
               "process:CMD: v4l2:/dev/video0, or NAME=ADDRESS if the robot's file names several",
               kMore);
  if (processes) add_fields(app, request_.image_settings);
  add_option(app, "--seed INTEGER", request_.seed, "Seed of all noise: the same seed gives the same bytes",
             kShown)
      ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 53, "INTEGER"));
}

SceneFlags::SceneFlags(Settings& settings, Reach reach, bool has_flag)
    : settings_(settings),
      has_flag_(has_flag),
      camera_(settings, "camera", "Camera with --images", reach),
      scene_(settings, "scene", "Scene with --images", reach) {}

Status SceneFlags::apply(bool images, std::optional<DetectingCameraOptions>& rendered) const {
  if (images) {
    DetectingCameraOptions scene_camera;
    Status status = camera_.apply(scene_camera.camera);
    if (status) status = scene_.apply(scene_camera.scene);
    if (status) rendered = scene_camera;
    return status;
  }
  const char* why = "options of camera and scene have no effect without images";
  const char* hint = has_flag_ ? "Add --images, or omit the options of camera and scene."
                               : "Omit the options of camera and scene.";
  Status status = refuse(camera_, why, hint);
  return status ? refuse(scene_, why, hint) : status;
}

std::vector<std::string> SceneFlags::as_words(const SetupFlags& setup, bool images) const {
  std::vector<std::string> words = setup.as_words();
  if (images) words.emplace_back("--images");
  for (const char* section : {"camera", "scene"}) {
    for (std::string& assignment : settings_.assignments(section))
      words.insert(words.end(), {"--set", std::move(assignment)});
  }
  return words;
}

ImageFlags::ImageFlags(Settings& settings, Reach reach, bool detects, Images images)
    : app_(settings.app()),
      scene_(settings, images == Images::Never ? Reach::SettingsOnly : reach, images != Images::Never) {
  CLI::App& app = settings.app();
  request_.threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1U, 16U));
  request_.images = images == Images::Always;
  if (images != Images::Never)
    add_flag(app, "--images", request_.images,
             images == Images::Always ? "Render camera images: always on for this verb"
                                      : "Render camera images and detect tags in them");
  if (detects)
    add_option(app, "--threads INTEGER", request_.threads,
               "Number of threads that render images and detect tags; the result does not depend on it. "
               "Default: one per core",
               between(1, 64), kMore);
  add_option(app, "--faults FILE", request_.faults,
             "Fault script: a .yaml file of faults and their times (docs/formats/faults.md)");
}

Result<RobotSetup> ImageFlags::apply(Result<RobotSetup> setup) const {
  if (!setup) return setup;
  Status status = apply_simulation(request_, given_on(app_), *setup);
  if (status) status = scene_.apply(request_.images, setup->simulated.images);
  if (!status) return tl::unexpected(status.error());
  return setup;
}

RobotWire standard_wire(Console& console, bool listen_only) {
  return {.input = STDIN_FILENO,
          .write =
              [](const std::string& line) {
                return std::fwrite(line.data(), 1, line.size(), stdout) == line.size() &&
                       std::fflush(stdout) == 0;
              },
          .note = [&console](const std::string& words) { console.note(words); },
          .should_stop = interrupted,
          .listen_only = listen_only};
}

}  // namespace waymark::cli
