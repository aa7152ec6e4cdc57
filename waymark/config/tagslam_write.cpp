#include "waymark/config/tagslam_write.hpp"

#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "waymark/config/yaml_write.hpp"

namespace waymark {
namespace {

/// Covariance of the error in the axes of the pose itself, where TagSLAM has it.
Matrix6 own_axes(const SE3& pose, const Matrix6& left) {
  const Matrix6 Ad = pose.inverse().adjoint();
  return Ad * left * Ad.transpose();
}

std::string xyz(const char* key, const Eigen::Vector3d& v, const std::string& indent) {
  return fmt::format("{0}{1}:\n{0}  x: {2}\n{0}  y: {3}\n{0}  z: {4}\n", indent, key, yaml_number(v.x()),
                     yaml_number(v.y()), yaml_number(v.z()));
}

std::string pose_with_noise(const SE3& pose, const Matrix6& left, const std::string& indent) {
  constexpr double kLeast = 1e-6;  // TagSLAM's own solver cannot take less
  const Eigen::VectorXd sigma = own_axes(pose, left).diagonal().cwiseMax(kLeast * kLeast).cwiseSqrt();
  return indent + "pose:\n" + xyz("position", pose.translation(), indent + "  ") +
         xyz("rotation", pose.rotation().log(), indent + "  ") +
         xyz("position_noise", sigma.head<3>(), indent + "  ") +
         xyz("rotation_noise", sigma.tail<3>(), indent + "  ");
}

}  // namespace

std::string to_tagslam_camera_poses(const SceneMap& map) {
  std::string text;
  for (std::size_t c = 0; c < map.scene.cameras.size(); ++c) {
    const PoseIndex at = map.problem.cameras[c];
    if (map.placed[at] == 0) continue;
    const SE3& pose = map.problem.bundle.poses[at].value;
    const Matrix6 P = own_axes(pose, map.covariance.poses[at]) + 1e-12 * Matrix6::Identity();
    Matrix6 rotation_first;
    rotation_first << P.bottomRightCorner<3, 3>(), P.bottomLeftCorner<3, 3>(), P.topRightCorner<3, 3>(),
        P.topLeftCorner<3, 3>();
    const Matrix6 R = rotation_first.inverse().llt().matrixU();
    text += fmt::format("{}:\n  pose:\n", map.scene.cameras[c].name) +
            xyz("position", pose.translation(), "    ") + xyz("rotation", pose.rotation().log(), "    ") +
            "    R: [";
    for (int i = 0; i < 36; ++i)
      text +=
          fmt::format("{}{:.8f}", i == 0 ? "" : ", ", R(i % 6, i / 6));  // by columns, as TagSLAM reads it
    text += "]\n";
  }
  return text;
}

std::string to_tagslam_poses(const SceneMap& map) {
  const SE3 half_turn(SO3::exp(Eigen::Vector3d(std::numbers::pi, 0, 0)), Eigen::Vector3d::Zero());
  std::string text = "bodies:\n";
  for (std::size_t b = 0; b < map.scene.bodies.size(); ++b) {
    const SceneBody& body = map.scene.bodies[b];
    text +=
        fmt::format(" - {}:\n     type: simple\n     is_static: {}\n", yaml_text(body.name), body.is_static);
    if (body.default_tag_size_m > 0)
      text += fmt::format("     default_tag_size: {}\n", yaml_number(body.default_tag_size_m));
    const PoseIndex at = map.problem.bodies[b].front();
    if (body.is_static && map.placed[at] != 0)
      text += pose_with_noise(map.problem.bundle.poses[at].value, map.covariance.poses[at], "     ");
    std::string tags;
    for (std::size_t t = 0; t < body.tags.size(); ++t) {
      const PoseIndex tag = map.problem.tags[b][t];
      if (map.placed[tag] == 0) continue;
      tags += fmt::format("       - id: {}\n         size: {}\n", body.tags[t].id.number,
                          yaml_number(body.tags[t].size_m));
      tags += pose_with_noise(map.problem.bundle.poses[tag].value * half_turn, map.covariance.poses[tag],
                              "         ");
    }
    if (!tags.empty()) text += "     tags:\n" + tags;
  }
  return text;
}

}  // namespace waymark
