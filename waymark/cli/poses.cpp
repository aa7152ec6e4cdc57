#include "waymark/cli/poses.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/base/angles.hpp"
#include "waymark/cli/detections_json.hpp"

namespace waymark::cli {
namespace {

using nlohmann::ordered_json;

ordered_json list(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

ordered_json solution_json(const TagPoseSolution& solution) {
  const PoseDeviations sigma = standard_deviations(solution.cam_T_tag, solution.covariance);
  const auto q = solution.cam_T_tag.rotation().quaternion();
  return {{"cam_t_tag_m", list(solution.cam_T_tag.translation())},
          {"cam_q_tag_xyzw", {q.x(), q.y(), q.z(), q.w()}},
          {"sigma_t_m", list(sigma.position_m)},
          {"sigma_r_rad", list(sigma.rotation_rad)},
          {"rms_px", solution.rms_px},
          {"chi2", solution.chi2}};
}

/// Between the line of sight and the tag's normal.
double incidence_deg(const SE3& cam_T_tag) {
  const Eigen::Vector3d normal = cam_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  return to_degrees(std::acos(std::clamp(normal.dot(cam_T_tag.translation().normalized()), -1.0, 1.0)));
}

std::string row(const std::string& name, const TagPoseSolution& solution) {
  const PoseDeviations sigma = standard_deviations(solution.cam_T_tag, solution.covariance);
  const Eigen::Vector3d& t = solution.cam_T_tag.translation();
  return fmt::format("  {:<22}{:>9.4f}{:>9.4f}{:>9.4f}{:>9.1f}{:>9.1f}{:>9.1f}{:>9.2f}{:>8.1f}{:>8.3f}\n",
                     name, t.x(), t.y(), t.z(), 1e3 * sigma.position_m.x(), 1e3 * sigma.position_m.y(),
                     1e3 * sigma.position_m.z(), to_degrees(sigma.rotation_rad.maxCoeff()),
                     incidence_deg(solution.cam_T_tag), solution.rms_px);
}

}  // namespace

PoseList poses_of(std::span<const TagDetection> detections, const PoseSetup& setup) {
  PoseList poses;
  for (const TagDetection& detection : detections)
    poses.push_back(estimate_tag_pose(detection, setup.sizes, setup.camera));
  return poses;
}

std::string to_text(std::span<const TagDetection> detections, const PoseList& poses) {
  if (poses.empty()) return {};
  std::string text =
      fmt::format("  {:<22}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>8}{:>8}\n", "pose in the camera", "x m",
                  "y m", "z m", "±x mm", "±y mm", "±z mm", "±rot °", "tilt °", "rms px");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string name = to_string(detections[i].tag);
    if (!poses[i]) {
      text += fmt::format("  {:<22}{}\n", name, to_string(poses[i].error()));
      continue;
    }
    text += row(name, poses[i]->best);
    if (poses[i]->other)
      text += row(fmt::format("  or (ratio {:.2f})", poses[i]->ambiguity_ratio()), *poses[i]->other);
  }
  return text;
}

void add_to_json(ordered_json& detection, const Result<TagPose>& pose) {
  if (!pose) {
    detection["pose_error"] = to_json(pose.error());
    return;
  }
  detection["pose"] = solution_json(pose->best);
  detection["pose"]["ambiguity_ratio"] = pose->ambiguity_ratio();
  detection["other_pose"] = pose->other ? solution_json(*pose->other) : ordered_json();
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
    const auto z = at(0, 0, -1);  // towards the reader, so that it is in view
    if (origin && x && y && z) axes.push_back({*origin, *x, *y, *z});
  }
  return axes;
}

}  // namespace waymark::cli
