#include "waymark/app/live/camera_address.hpp"

#include <algorithm>
#include <utility>

#include "waymark/cameras/gstreamer/gstreamer_camera.hpp"
#include "waymark/cameras/v4l2/v4l2_camera.hpp"

namespace waymark {

bool is_camera_address(std::string_view word) {
  return word.starts_with(kV4l2Scheme) || word.starts_with(kGstreamerScheme);
}

Result<bool> is_only_camera(const std::vector<std::string>& sources) {
  const bool live = sources.size() == 1 && is_camera_address(sources.front());
  if (!live && std::ranges::any_of(sources, is_camera_address))
    return fail(ErrorCode::InvalidArgument, "a live camera is the only input", {},
                "Run the program once for each camera.");
  return live;
}

Result<bool> are_cameras(const std::vector<std::string>& sources) {
  const bool live = !sources.empty() && std::ranges::all_of(sources, is_camera_address);
  if (!live && std::ranges::any_of(sources, is_camera_address))
    return fail(ErrorCode::InvalidArgument, "live cameras and files are named together", {},
                "Run the program once for the files, and once for the cameras.");
  for (auto source = sources.begin(); live && source != sources.end(); ++source)
    if (std::find(sources.begin(), source, *source) != source)
      return fail(ErrorCode::InvalidArgument, "this camera is named twice", {.source = *source},
                  "Name each camera once.");
  return live;
}

Result<CameraAddress> parse_camera_address(const std::string& word, const std::string& name) {
  const std::size_t sign = word.find('=');
  const bool named = !is_camera_address(word) && sign != std::string::npos;
  CameraAddress camera{named ? word.substr(0, sign) : name, named ? word.substr(sign + 1) : word};
  if (is_camera_address(camera.address) && !camera.name.empty()) return camera;
  return fail(ErrorCode::InvalidArgument, "this is no address of a camera", {.source = word},
              "For example v4l2:/dev/video0 or left=v4l2:/dev/video2; `waymark cameras` lists them.");
}

Result<std::unique_ptr<LiveCamera>> open_live_camera(const std::string& address, const std::string& name) {
  if (!is_camera_address(address))
    return fail(ErrorCode::InvalidArgument, "this is no address of a camera", {.source = address},
                "For example v4l2:/dev/video0; `waymark cameras` lists them.");
  if (address.starts_with(kGstreamerScheme)) {
    auto camera = GstreamerCamera::open(address.substr(kGstreamerScheme.size()), name);
    if (!camera) return tl::unexpected(camera.error());
    return std::unique_ptr<LiveCamera>(std::move(*camera));
  }
  auto options = parse_v4l2_address(address);
  if (!options) return tl::unexpected(options.error());
  options->name = name;
  auto camera = V4l2Camera::open(*options);
  if (!camera) return tl::unexpected(camera.error());
  return std::unique_ptr<LiveCamera>(std::move(*camera));
}

}  // namespace waymark
