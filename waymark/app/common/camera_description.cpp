#include "waymark/app/common/camera_description.hpp"

#include <charconv>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/config/calibration_file.hpp"
#include "waymark/config/camera_file.hpp"

namespace waymark {
namespace {

/// Width and height of "1280x720".
std::optional<std::pair<int, int>> parse_size(const std::string& text) {
  int width = 0;
  int height = 0;
  const char* end = text.data() + text.size();
  const auto [cross, first] = std::from_chars(text.data(), end, width);
  if (first != std::errc() || cross == end || *cross != 'x') return std::nullopt;
  const auto [stop, second] = std::from_chars(cross + 1, end, height);
  const bool whole = second == std::errc() && stop == end && width > 0 && height > 0;
  return whole ? std::optional(std::pair(width, height)) : std::nullopt;
}

Status scale(const std::string& size, DescribedCamera& camera) {
  const auto wanted = parse_size(size);
  if (!wanted)
    return fail(ErrorCode::InvalidArgument, fmt::format("'{}' is no size of a picture", size),
                {.key = "--camera-size"}, "Give width and height in pixels: 1280x720.");
  const double x = static_cast<double>(wanted->first) / camera.camera.width_px();
  const double y = static_cast<double>(wanted->second) / camera.camera.height_px();
  Result<CameraModel> scaled = scaled_camera(camera.camera, wanted->first, wanted->second);
  if (!scaled) {
    scaled.error().place = {.key = "--camera-size"};
    return tl::unexpected(scaled.error());
  }
  camera.camera = *scaled;
  if (camera.intrinsics_sigma.size() >= 4)
    camera.intrinsics_sigma.head<4>().array() *= Eigen::Array4d(x, y, x, y);
  return {};
}

}  // namespace

Result<DescribedCamera> read_camera(const CameraDescription& description) {
  const Result<NamedCamera> named = read_camera(description.file, description.name);
  if (!named) return tl::unexpected(named.error());
  DescribedCamera read{.camera = named->camera};
  if (const Result<Calibration> ours = read_calibration(description.file)) {
    read.intrinsics_sigma = intrinsics_sigma(read.camera, *ours);
    read.readout_s = ours->known("readout_s").value_or(0);
  }
  if (description.readout_ms) read.readout_s = *description.readout_ms * 1e-3;
  if (description.size.empty()) return read;
  if (Status scaled = scale(description.size, read); !scaled) return tl::unexpected(scaled.error());
  return read;
}

Result<std::optional<PoseSetup>> described_poses(const CameraDescription& camera,
                                                 const std::vector<std::string>& tag_sizes) {
  const bool named = !camera.name.empty();
  if (camera.file.empty() && (named || !camera.size.empty()))
    return fail(ErrorCode::InvalidArgument, "no file is given in which this camera is described",
                {.key = named ? "--camera-name" : "--camera-size"},
                "Give --camera camera.yaml and --tag-size-m 0.16, or leave it out.");
  if (camera.file.empty() && tag_sizes.empty()) return std::optional<PoseSetup>();
  if (camera.file.empty() || tag_sizes.empty()) {
    return fail(ErrorCode::InvalidArgument, "poses need both the camera and the size of the tags",
                {.key = camera.file.empty() ? "--camera" : "--tag-size-m"},
                "Give --camera camera.yaml and --tag-size-m 0.16 (the side of the black square in metres).");
  }
  Result<TagSizes> sizes = parse_tag_sizes(tag_sizes);
  if (!sizes) return tl::unexpected(sizes.error());
  const Result<DescribedCamera> described = read_camera(camera);
  if (!described) return tl::unexpected(described.error());
  return std::optional<PoseSetup>(PoseSetup{described->camera, std::move(*sizes)});
}

Status check_picture_size(const CameraModel& camera, int width_px, int height_px) {
  Status fits = check_camera_matches_image(camera, width_px, height_px);
  if (fits) return fits;
  fits.error().code = ErrorCode::Unsupported;  // the pictures, by this calibration
  const bool scales = scaled_camera(camera, width_px, height_px).has_value();
  if (scales)
    fits.error().hint = fmt::format(
        "Calibrate at the resolution in use; or, where both show the same field of view, scale the "
        "calibration: --camera-size {}x{}.",
        width_px, height_px);
  return fits;
}

}  // namespace waymark
