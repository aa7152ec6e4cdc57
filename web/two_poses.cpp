// The two poses of one square tag on the optical axis, tilted about its vertical axis, from corners with
// noise. The room pose estimates both. The program also counts how often noise makes the wrong pose fit
// better.
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include <emscripten.h>

#include <fmt/format.h>

#include "answer.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/random.hpp"
#include "waymark/pose/square_pose.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark::web {
namespace {

constexpr double kTagSize_m = 0.1;
constexpr double kNoise_px = 0.2;
constexpr int kDraws = 200;

using Corners = std::array<Eigen::Vector2d, 4>;

Result<CameraModel> camera() {
  return CameraModel::make(PinholeRadtan{.fx = 600, .fy = 600, .cx = 320, .cy = 240}, 640, 480);
}

std::optional<Corners> project(const CameraModel& camera, const SE3& cam_T_tag) {
  Corners corners;
  const auto tag_p_corners = square_corners(kTagSize_m);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto px = camera.project(cam_T_tag * tag_p_corners[i]);
    if (!px) return std::nullopt;
    corners[i] = *px;
  }
  return corners;
}

Corners with_noise(const Corners& exact, Random& random) {
  Corners noisy;
  for (std::size_t i = 0; i < noisy.size(); ++i) {
    const double x = random.normal(exact[i].x(), kNoise_px);
    const double y = random.normal(exact[i].y(), kNoise_px);
    noisy[i] = {x, y};
  }
  return noisy;
}

Result<TagPose> pose_of(const CameraModel& camera, const Corners& corners) {
  return estimate_tag_pose(TagDetection{.corners_px = corners}, kTagSize_m, camera,
                           {.corner_sigma_px = kNoise_px});
}

/// Signed tilt about the camera's vertical axis [rad], of the tag's z axis.
double tilt_of(const SE3& cam_T_tag) {
  const Eigen::Vector3d axis = cam_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  return std::atan2(axis.x(), axis.z());
}

std::string solution_json(const CameraModel& camera, const TagPoseSolution& solution) {
  const Eigen::Vector3d& t = solution.cam_T_tag.translation();
  const Eigen::Vector3d axis = solution.cam_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  const std::optional<Corners> corners = project(camera, solution.cam_T_tag);
  return fmt::format(
      R"({{"tilt_deg":{:.9g},"rms_px":{:.9g},"chi2":{:.9g},"cam_t_tag_m":[{:.9g},{:.9g},{:.9g}],)"
      R"("cam_z_tag":[{:.9g},{:.9g},{:.9g}],"corners_px":{}}})",
      to_degrees(tilt_of(solution.cam_T_tag)), solution.rms_px, solution.chi2, t.x(), t.y(), t.z(), axis.x(),
      axis.y(), axis.z(), corners ? points(*corners) : "[]");
}

/// Number of noise draws in which the better-fitting pose is tilted in the wrong direction.
int wrong_draws(const CameraModel& camera, const Corners& exact, double tilt_rad, Random random) {
  int wrong = 0;
  for (int i = 0; i < kDraws; ++i) {
    const Result<TagPose> found = pose_of(camera, with_noise(exact, random));
    if (found && tilt_of(found->best.cam_T_tag) * tilt_rad < 0) ++wrong;
  }
  return wrong;
}

std::string two_poses(double tilt_deg, double distance_m, std::uint64_t seed) {
  const double tilt_rad = to_radians(tilt_deg);
  const SE3 cam_T_tag(SO3::exp({0, tilt_rad, 0}), {0, 0, distance_m});
  const Result<CameraModel> model = camera();
  const std::optional<Corners> exact = model ? project(*model, cam_T_tag) : std::nullopt;
  if (!exact) return R"({"error":"the tag is not visible to the camera"})";
  Random random(seed);
  const Corners observed = with_noise(*exact, random);
  const Result<TagPose> found = pose_of(*model, observed);
  if (!found) return fmt::format("{{\"error\":{}}}", quoted(to_string(found.error())));
  std::string solutions = solution_json(*model, found->best);
  if (found->other) solutions += ',' + solution_json(*model, *found->other);
  return fmt::format(
      R"({{"observed_px":{},"exact_px":{},"solutions":[{}],"ambiguity_ratio":{:.6g},"likelihood_ratio":{:.6g},)"
      R"("draws":{},"wrong_draws":{}}})",
      points(observed), points(*exact), solutions, found->ambiguity_ratio(), found->likelihood_ratio(),
      kDraws, wrong_draws(*model, *exact, tilt_rad, random));
}

}  // namespace
}  // namespace waymark::web

extern "C" {

/// JSON: corners, one or two poses with their reprojection errors, and how often the wrong one fits better;
/// or an error.
EMSCRIPTEN_KEEPALIVE const char* waymark_two_poses(double tilt_deg, double distance_m, int seed) {
  return waymark::web::keep(waymark::web::two_poses(tilt_deg, distance_m, static_cast<std::uint64_t>(seed)));
}
}
