#include "waymark/cli/pose_flags.hpp"

#include "waymark/cli/flags.hpp"
#include "waymark/cli/options_flags.hpp"

namespace waymark::cli {

void add_camera_details(CLI::App& app, CameraDescription& camera) {
  add_option(app, "--camera-name NAME", camera.name,
             "Name of the camera of --camera, when the file holds several", kMore);
  add_option(app, "--camera-size WIDTHxHEIGHT", camera.size,
             "Size of the pictures, such as 1280x720, where the calibration was made at another one: it is "
             "scaled, which is right when both show the same field of view",
             kMore);
}

PoseFlags::PoseFlags(CLI::App& verb) : app_(verb) {
  CLI::App& app = verb;
  add_option(app, "--camera FILE", camera_.file,
             "Calibration of the camera (ROS camera_info, kalibr YAML or JSON of PhotonVision): gives the "
             "pose of each tag");
  add_camera_details(app, camera_);
  app.add_option("--tag-size-m", sizes_,
                 "Side of the square where black border meets white [m]; ID=SIZE for a tag of another size "
                 "(repeatable)")
      ->allow_extra_args(false)  // or it would take the pictures that follow for sizes
      ->type_name("SIZE");
}

Status PoseFlags::refuse_all(const std::string& why, const std::string& hint) const {
  Refusals refused(app_);
  refused.flags(true, {"--camera", "--camera-name", "--camera-size", "--tag-size-m"}, why, hint);
  return refused.status();
}

}  // namespace waymark::cli
