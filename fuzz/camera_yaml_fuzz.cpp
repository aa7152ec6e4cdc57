// Any bytes as a camera calibration: a result or an error with a message, never a crash; parsed calibrations
// can be written and read back unchanged.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "waymark/config/exchange/camera_file.hpp"

namespace {

void demand(bool holds) {
  if (!holds) std::abort();
}

bool finite_or_nothing(const waymark::CameraModel& camera, const Eigen::Vector2d& px) {
  const auto bearing = camera.unproject(px);
  return !bearing || (bearing->allFinite() && camera.project(*bearing).has_value());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto cameras = waymark::parse_cameras(text, "fuzz");
  if (!cameras) {
    demand(!cameras.error().message.empty());
    return 0;
  }
  for (const waymark::NamedCamera& named : *cameras) {
    const waymark::CameraModel& camera = named.camera;
    for (const double u : {0.0, 0.5, 1.0}) {
      for (const double v : {0.0, 0.25, 1.0}) {
        demand(finite_or_nothing(camera, {u * camera.width_px(), v * camera.height_px()}));
      }
    }
    const auto again = waymark::parse_camera(waymark::to_camera_info_yaml(named), "written");
    demand(again.has_value() && again->camera.width_px() == camera.width_px());
  }
  const auto camchain = waymark::to_camchain_yaml(*cameras);
  if (camchain) demand(waymark::parse_cameras(*camchain, "written").has_value());
  return 0;
}
