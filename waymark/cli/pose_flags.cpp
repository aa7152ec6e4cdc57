#include "waymark/cli/pose_flags.hpp"

#include "waymark/cli/job_flags.hpp"
#include "waymark/cli/options_flags.hpp"

namespace waymark::cli {

PoseFlags::PoseFlags(CLI::App& verb) : app_(verb) {
  CLI::App& app = verb;
  add_option(app, "--camera FILE", camera_.file,
             "Calibration of the camera (ROS camera_info, kalibr YAML or JSON of PhotonVision): gives the "
             "pose of each tag");
  add_fields(app, camera_);
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
