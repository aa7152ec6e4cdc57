#include "waymark/pose/starting_poses.hpp"

#include <utility>

#include <fmt/format.h>

#include "waymark/pose/square_pose.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark::internal {
namespace {

constexpr std::array<const char*, 4> kCornerNames = {"TL", "TR", "BR", "BL"};

tl::unexpected<Error> invalid(const TagDetection& detection, std::string message, std::string hint) {
  return fail(ErrorCode::InvalidArgument, std::move(message), {.key = to_string(detection.tag)},
              std::move(hint));
}

Result<Corners3> bearings_of(const TagDetection& detection, const CameraModel& camera) {
  Corners3 bearings;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& px = detection.corners_px[i];
    if (!px.allFinite()) {
      return invalid(detection, fmt::format("corner {} is not at a finite position", kCornerNames[i]),
                     "Check where the detection came from.");
    }
    const auto bearing = camera.unproject(px);
    if (!bearing) {
      return invalid(
          detection,
          fmt::format("corner {} at ({:.1f}, {:.1f}) px is where the lens model shows no point",
                      kCornerNames[i], px.x(), px.y()),
          "Calibrate with views that reach the edges of the image, or check that the calibration belongs to "
          "this camera and resolution.");
    }
    bearings[i] = *bearing;
  }
  return bearings;
}

}  // namespace

Result<std::array<SE3, 2>> starting_poses(const TagDetection& detection, double size_m,
                                          const CameraModel& camera) {
  if (!is_tag_size(size_m)) {
    return invalid(detection, fmt::format("{} m is not the size of a tag", size_m),
                   "Give the side of the black square in metres, measured where black meets white.");
  }
  const Result<Corners3> bearings = bearings_of(detection, camera);
  if (!bearings) return tl::unexpected<Error>(bearings.error());
  const SquarePoses poses = square_poses(*bearings, size_m);
  if (poses.defect != QuadDefect::None) {
    return invalid(
        detection, to_string(poses.defect),
        "Give the corners of the printed tag in the order TL, TR, BR, BL, as a reader of the tag sees them.");
  }
  return poses.cam_T_tag;
}

Result<Whitening> whitening_of(const TagDetection& detection, double sigma_px) {
  if (!detection.corner_covariance_px2) return Whitening(sigma_px);
  const std::optional<Whitening> whitening = Whitening::of(*detection.corner_covariance_px2);
  if (!whitening) {
    return invalid(detection, "the covariance of the corners is not finite and positive definite",
                   "Leave it out, or check how the detector makes it.");
  }
  return *whitening;
}

}  // namespace waymark::internal
