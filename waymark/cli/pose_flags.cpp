#include "waymark/cli/pose_flags.hpp"

#include <utility>

#include "waymark/cli/flags.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/config/camera_file.hpp"

namespace waymark::cli {
PoseFlags::PoseFlags(CLI::App& verb) : app_(verb) {
  CLI::App& app = verb;
  add_option(app, "--camera FILE", camera_path_,
             "Calibration of the camera (ROS camera_info, kalibr YAML or JSON of PhotonVision): gives the "
             "pose of each tag");
  add_option(app, "--camera-name NAME", camera_name_, "Name of the camera, when the file holds several");
  app.add_option("--tag-size-m", sizes_,
                 "Side of the square where black border meets white [m]; ID=SIZE for a tag of another size "
                 "(repeatable)")
      ->allow_extra_args(false)  // or it would take the pictures that follow for sizes
      ->type_name("SIZE");
}

Status PoseFlags::refuse_all(const std::string& why, const std::string& hint) const {
  Status status;
  for (const char* flag : {"--camera", "--camera-name", "--tag-size-m"}) {
    if (status) status = refuse_flag(app_, flag, why, hint);
  }
  return status;
}

Result<std::optional<PoseSetup>> PoseFlags::make() const {
  if (camera_path_.empty() && !camera_name_.empty())
    return fail(ErrorCode::InvalidArgument, "no file is given in which this camera is described",
                {.key = "--camera-name"},
                "Give --camera camera.yaml and --tag-size-m 0.16, or leave it out.");
  if (camera_path_.empty() && sizes_.empty()) return std::optional<PoseSetup>();
  if (camera_path_.empty() || sizes_.empty()) {
    return fail(ErrorCode::InvalidArgument, "poses need both the camera and the size of the tags",
                {.key = camera_path_.empty() ? "--camera" : "--tag-size-m"},
                "Give --camera camera.yaml and --tag-size-m 0.16 (the side of the black square in metres).");
  }
  Result<TagSizes> sizes = parse_tag_sizes(sizes_);
  if (!sizes) return tl::unexpected(sizes.error());
  Result<NamedCamera> camera = read_camera(camera_path_, camera_name_);
  if (!camera) return tl::unexpected(camera.error());
  return std::optional<PoseSetup>(PoseSetup{camera->camera, std::move(*sizes)});
}

}  // namespace waymark::cli
