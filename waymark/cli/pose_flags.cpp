#include "waymark/cli/pose_flags.hpp"

#include <utility>

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
  Status status;
  for (const char* flag : {"--camera", "--camera-name", "--camera-size", "--tag-size-m"}) {
    if (status) status = refuse_flag(app_, flag, why, hint);
  }
  return status;
}

Result<std::optional<PoseSetup>> PoseFlags::make() const {
  const bool named = !camera_.name.empty();
  if (camera_.file.empty() && (named || !camera_.size.empty()))
    return fail(ErrorCode::InvalidArgument, "no file is given in which this camera is described",
                {.key = named ? "--camera-name" : "--camera-size"},
                "Give --camera camera.yaml and --tag-size-m 0.16, or leave it out.");
  if (camera_.file.empty() && sizes_.empty()) return std::optional<PoseSetup>();
  if (camera_.file.empty() || sizes_.empty()) {
    return fail(ErrorCode::InvalidArgument, "poses need both the camera and the size of the tags",
                {.key = camera_.file.empty() ? "--camera" : "--tag-size-m"},
                "Give --camera camera.yaml and --tag-size-m 0.16 (the side of the black square in metres).");
  }
  Result<TagSizes> sizes = parse_tag_sizes(sizes_);
  if (!sizes) return tl::unexpected(sizes.error());
  const Result<DescribedCamera> camera = read_camera(camera_);
  if (!camera) return tl::unexpected(camera.error());
  return std::optional<PoseSetup>(PoseSetup{camera->camera, std::move(*sizes)});
}

}  // namespace waymark::cli
