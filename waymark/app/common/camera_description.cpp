#include "waymark/app/common/camera_description.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/yaml/calibration_file.hpp"

namespace waymark {
namespace {

std::array<double, 3> numbers_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

struct ReportedSolution {
  TagPoseSolution solution{};
};

ReportFields fields(const ReportedSolution& reported) {
  const TagPoseSolution& solution = reported.solution;
  const PoseDeviations sigma = standard_deviations(solution.cam_T_tag, solution.covariance);
  const PoseDeviations lens = standard_deviations(solution.cam_T_tag, solution.lens_covariance);
  const auto q = solution.cam_T_tag.rotation().quaternion();
  return {{"cam_t_tag_m", "x, y, z of the tag in the camera (x right, y down, z forward)",
           numbers_of(solution.cam_T_tag.translation())},
          {"cam_q_tag_xyzw", "Rotation of the tag in the camera", std::array{q.x(), q.y(), q.z(), q.w()}},
          {"sigma_t_m", "Standard deviation of x, y, z", numbers_of(sigma.position_m)},
          {"sigma_r_rad", "Standard deviation of the rotation about x, y, z", numbers_of(sigma.rotation_rad)},
          {"sigma_t_lens_m",
           "The part of sigma_t_m from the uncertainty of the camera calibration, which is the same in all "
           "images; 0 if the camera file contains no standard deviations",
           numbers_of(lens.position_m)},
          {"rms_px", "Root mean square reprojection error of the corners", solution.rms_px},
          {"chi2", "Chi-square of the corners, 2 degrees of freedom", solution.chi2},
          {"sigma_scale",
           "Factor contained in sigma_t_m and sigma_r_rad: above 1 if chi2 is too large for chance",
           solution.sigma_scale}};
}

struct ReportedPose {
  TagPose pose{};
};

ReportFields fields(const ReportedPose& reported) {
  ReportFields all = fields(ReportedSolution{reported.pose.best});
  all.push_back({"ambiguity_ratio",
                 "Ratio of the rms_px of this pose to that of the other one, 0 to 1; near 1: ambiguous",
                 reported.pose.ambiguity_ratio()});
  return all;
}

}  // namespace

PoseList poses_of(std::span<const TagDetection> detections, const PoseSetup& setup) {
  PoseList poses;
  TagPoseOptions options;
  options.intrinsics_covariance = setup.intrinsics_covariance;
  for (const TagDetection& detection : detections)
    poses.push_back(estimate_tag_pose(detection, setup.sizes, setup.camera, options));
  return poses;
}

std::size_t count_misfits(const PoseList& poses) {
  constexpr double kMisfit = 5;
  return static_cast<std::size_t>(std::ranges::count_if(
      poses, [](const Result<TagPose>& pose) { return pose && pose->best.sigma_scale > kMisfit; }));
}

std::string misfit_note(std::size_t misfits, std::size_t poses) {
  return fmt::format(
      "{} of {} do not fit the corners. Check that the calibration belongs to this camera, lens and image "
      "size.",
      misfits, counted(poses, "pose"));
}

ReportFields pose_fields(const std::optional<Result<TagPose>>& pose) {
  std::optional<ReportedPose> best;
  std::optional<std::optional<ReportedSolution>> other;
  std::optional<Error> error;
  if (pose && *pose) {
    best = ReportedPose{**pose};
    other.emplace();
    if ((*pose)->other) *other = ReportedSolution{*(*pose)->other};
  } else if (pose) {
    error = pose->error();
  }
  return {{"pose", "With `camera` and `tag_size_m`: pose with the smaller reprojection error", if_any(best)},
          {"other_pose", "The other pose hypothesis; null if there is none", if_any(other)},
          {"pose_error", "Instead of a pose: why there is none", if_any(error)}};
}

std::vector<plot::FrameAxes> axes_of(std::span<const TagDetection> detections, const PoseList& poses,
                                     const PoseSetup& setup) {
  std::vector<plot::FrameAxes> axes;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Result<double> size = setup.sizes.size_m(detections[i].tag);
    if (!poses[i] || !size) continue;
    const SE3& cam_T_tag = poses[i]->best.cam_T_tag;
    const auto at = [&](double x, double y, double z) {
      return setup.camera.project(cam_T_tag * (*size / 2 * Eigen::Vector3d(x, y, z)));
    };
    const auto origin = at(0, 0, 0);
    const auto x = at(1, 0, 0);
    const auto y = at(0, 1, 0);
    const auto z = at(0, 0, -1);  // points towards the viewer, so that it is visible
    if (origin && x && y && z) axes.push_back({*origin, *x, *y, *z});
  }
  return axes;
}

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
    return fail(ErrorCode::InvalidArgument, fmt::format("invalid image size '{}'", size),
                {.key = "camera_size"}, "Give width and height in pixels: 1280x720.");
  const double x = static_cast<double>(wanted->first) / camera.camera.width_px();
  const double y = static_cast<double>(wanted->second) / camera.camera.height_px();
  Result<CameraModel> scaled = scaled_camera(camera.camera, wanted->first, wanted->second);
  if (!scaled) {
    scaled.error().place = {.key = "camera_size"};
    return tl::unexpected(scaled.error());
  }
  camera.camera = *scaled;
  if (camera.intrinsics_sigma.size() >= 4)
    camera.intrinsics_sigma.head<4>().array() *= Eigen::Array4d(x, y, x, y);
  if (camera.intrinsics_covariance.rows() >= 4) {
    const Eigen::Vector4d scales(x, y, x, y);
    IntrinsicsCovariance& C = camera.intrinsics_covariance;
    C.topRows<4>() = (scales.asDiagonal() * C.topRows<4>()).eval();
    C.leftCols<4>() = (C.leftCols<4>() * scales.asDiagonal()).eval();
  }
  return {};
}

}  // namespace

Result<DescribedCamera> read_camera(const CameraDescription& description) {
  const auto named =
      or_wrong_kind(read_camera(description.file, description.name), description.file, FileUse::Camera);
  if (!named) return tl::unexpected(named.error());
  DescribedCamera read{.camera = named->camera};
  if (kind_of(description.file) == FileKind::Calibration) {
    const Result<Calibration> ours = read_calibration(description.file);
    if (!ours) return tl::unexpected(ours.error());
    read.intrinsics_sigma = intrinsics_sigma(read.camera, *ours);
    read.intrinsics_covariance = intrinsics_covariance(read.camera, *ours);
    read.readout_s = ours->observable_value("readout_s").value_or(0);
  }
  if (description.readout_ms) read.readout_s = *description.readout_ms * 1e-3;
  if (description.size.empty()) return read;
  if (Status scaled = scale(description.size, read); !scaled) return tl::unexpected(scaled.error());
  return read;
}

Result<std::optional<PoseSetup>> described_poses(const CameraDescription& camera,
                                                 const std::vector<std::string>& tag_sizes,
                                                 SearchedFamilies families) {
  const bool named = !camera.name.empty();
  if (camera.file.empty() && (named || !camera.size.empty()))
    return fail(ErrorCode::InvalidArgument, "`camera` is not set, so this camera has no calibration",
                {.key = named ? "camera_name" : "camera_size"},
                "Set `camera=camera.yaml` and `tag_size_m=0.16`, or omit this option.");
  if (camera.file.empty() && tag_sizes.empty()) return std::optional<PoseSetup>();
  if (camera.file.empty() || tag_sizes.empty()) {
    return fail(ErrorCode::InvalidArgument, "poses require both the camera and the tag size",
                {.key = camera.file.empty() ? "camera" : "tag_size_m"},
                "Set `camera=camera.yaml` and `tag_size_m=0.16` (the side of the black square in metres).");
  }
  Result<TagSizes> sizes = parse_tag_sizes(tag_sizes, families);
  if (!sizes) return tl::unexpected(sizes.error());
  const Result<DescribedCamera> described = read_camera(camera);
  if (!described) return tl::unexpected(described.error());
  return std::optional<PoseSetup>(
      PoseSetup{described->camera, std::move(*sizes), described->intrinsics_covariance});
}

std::string calibration_note(const PoseSetup& setup) {
  return setup.intrinsics_covariance.size() > 0
             ? "standard deviations of poses include the uncertainty of the camera calibration"
             : "the camera file contains no standard deviations, so poses assume an exact calibration";
}

Status check_image_size(const CameraModel& camera, int width_px, int height_px) {
  Status fits = check_camera_matches_image(camera, width_px, height_px);
  if (fits) return fits;
  fits.error().code = ErrorCode::Unsupported;  // images of this size with this calibration
  const bool scales = scaled_camera(camera, width_px, height_px).has_value();
  if (scales)
    fits.error().hint = fmt::format(
        "Calibrate at the resolution in use; or, if both have the same field of view, scale the "
        "calibration: `camera_size={}x{}`.",
        width_px, height_px);
  return fits;
}

}  // namespace waymark
