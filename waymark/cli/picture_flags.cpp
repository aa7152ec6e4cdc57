#include "waymark/cli/picture_flags.hpp"

#include <algorithm>
#include <thread>

#include "waymark/config/faults_file.hpp"

namespace waymark::cli {

PictureFlags::PictureFlags(CLI::App& app)
    : threads_(static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1U, 16U))),
      camera_(app, "Camera (with --images)"),
      scene_(app, "Scene (with --images)") {
  app.add_flag("--images", images_, "The camera takes pictures, and the detector looks at them");
  app.add_option("--threads", threads_,
                 "Number of threads that render pictures and detect tags; the result does not depend on it. "
                 "Unless given: one per core")
      ->check(CLI::Range(1, 64))
      ->type_name("INTEGER");
  app.add_option("--faults", faults_,
                 "Fault script: a .yaml file of faults and their times (docs/formats/faults.md)")
      ->type_name("FILE");
}

Status PictureFlags::apply(SimulatedStage& stage) const {
  stage.threads = threads_;
  if (images_) {
    SceneEyeOptions eye;
    if (Status status = camera_.apply(eye.camera); !status) return status;
    if (Status status = scene_.apply(eye.scene); !status) return status;
    stage.pictures = eye;
  }
  if (!images_ && (camera_.given() || scene_.given()))
    return fail(ErrorCode::InvalidArgument, "without pictures there is no camera to set", {.key = "--images"},
                "Add --images, or leave out the flags of camera and scene.");
  if (faults_.empty()) return {};
  auto faults = read_faults(faults_, stage.world);
  if (!faults) return tl::unexpected(faults.error());
  stage.robot.faults = std::move(*faults);
  return {};
}

}  // namespace waymark::cli
