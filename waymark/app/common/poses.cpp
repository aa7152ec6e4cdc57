#include "waymark/app/common/poses.hpp"

#include <charconv>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/json_line.hpp"

namespace waymark {
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

Result<double> parse_size_m(const std::string& text, const std::string& whole) {
  double size_m = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), size_m);
  if (error == std::errc() && end == text.data() + text.size() && is_tag_size(size_m)) return size_m;
  return fail(
      ErrorCode::InvalidArgument, fmt::format("'{}' is not a size in metres", whole), {.key = "--tag-size-m"},
      "Measure the side of the square where black border meets white, for example --tag-size-m 0.16.");
}

}  // namespace

Result<TagSizes> parse_tag_sizes(const std::vector<std::string>& words) {
  TagSizes sizes;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    const Result<double> size =
        parse_size_m(equals == std::string::npos ? word : word.substr(equals + 1), word);
    if (!size) return tl::unexpected(size.error());
    if (equals == std::string::npos) {
      sizes.default_size_m = *size;
      continue;
    }
    const std::string name = word.substr(0, equals);
    const Result<TagId> tag = parse_tag_id(name.find(':') == std::string::npos ? "tag36h11:" + name : name);
    if (!tag) return tl::unexpected(tag.error());
    sizes.size_by_tag_m[*tag] = *size;
  }
  return sizes;
}

PoseList poses_of(std::span<const TagDetection> detections, const PoseSetup& setup) {
  PoseList poses;
  for (const TagDetection& detection : detections)
    poses.push_back(estimate_tag_pose(detection, setup.sizes, setup.camera));
  return poses;
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

}  // namespace waymark
