#include "waymark/app/cli/picture_flags.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include "waymark/app/cli/flags.hpp"

namespace waymark::cli {

SceneFlags::SceneFlags(Settings& settings, Reach reach)
    : settings_(settings),
      camera_(settings, "camera", "Camera with --images", reach),
      scene_(settings, "scene", "Scene with --images", reach) {}

Status SceneFlags::apply(bool images, std::optional<DetectingCameraOptions>& pictures) const {
  if (images) {
    DetectingCameraOptions scene_camera;
    Status status = camera_.apply(scene_camera.camera);
    if (status) status = scene_.apply(scene_camera.scene);
    if (status) pictures = scene_camera;
    return status;
  }
  const char* why = "without pictures there is no camera to set";
  const char* hint = "Add --images, or leave out the options of camera and scene.";
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

PictureFlags::PictureFlags(Settings& settings, Reach reach, bool detects)
    : app_(settings.app()), scene_(settings, reach) {
  CLI::App& app = settings.app();
  words_.threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1U, 16U));
  app.add_flag("--images", words_.images, "Render camera pictures and detect tags in them");
  if (detects)
    add_option(app, "--threads INTEGER", words_.threads,
               "Number of threads that render pictures and detect tags; the result does not depend on it. "
               "Unless given: one per core",
               between(1, 64), kMore);
  add_option(app, "--faults FILE", words_.faults,
             "Fault script: a .yaml file of faults and their times (docs/formats/faults.md)");
}

Result<RobotSetup> PictureFlags::apply(Result<RobotSetup> setup) const {
  if (!setup) return setup;
  Status status = describe_simulated(words_, given_on(app_), *setup);
  if (status) status = scene_.apply(words_.images, setup->simulated.pictures);
  if (!status) return tl::unexpected(status.error());
  return setup;
}

}  // namespace waymark::cli
