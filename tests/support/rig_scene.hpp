#pragma once

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/samples/visibility.hpp"

/// A rig of one or two cameras that moves past a wall of tags, of which the first has a known pose, and its
/// true map.
namespace waymark::test {

inline constexpr double kRigTag_m = 0.2;

struct RigShape {
  std::size_t frames = 24, tags = 8, cameras = 1;
  double step_s = 0.1;   ///< between frames
  double noise_px = 0;   ///< of corners
  double readout_s = 0;  ///< of a rolling shutter
  std::uint64_t seed = 1;
};

struct RigScene {
  RigShape shape{};
  TagScene scene{};
  SceneRecording recording{};
  std::vector<SE3> rig{};      ///< map_T_rig by frame
  std::vector<SE3> cameras{};  ///< rig_T_cam
  std::vector<SE3> tags{};     ///< map_T_tag by number
};

inline SE3 at(double x, double y, double z, double rx = 0, double ry = 0, double rz = 0) {
  return {SO3::exp({rx, ry, rz}), Eigen::Vector3d(x, y, z)};
}

inline TagId rig_tag(std::size_t number) { return {FamilyId::Tag36h11, static_cast<int>(number)}; }

inline ScenePrior exactly(const SE3& mean) {
  return ScenePrior::of(mean, Eigen::Vector3d::Constant(1e-4), Eigen::Vector3d::Constant(1e-4));
}

/// Pose of the rig at a time [frames].
inline SE3 rig_at(const RigShape& shape, double frame) {
  const double s = frame / static_cast<double>(shape.frames);
  return at(2.4 * s - 1.2, 0.3 * std::sin(9 * s), 0.3 * s, 0.1 * std::sin(5 * s), 0.1, 0.2 * std::sin(7 * s));
}

/// The corners of a tag in a rolling-shutter camera.
inline std::optional<std::array<Eigen::Vector2d, 4>> rig_corners(const RigScene& made, std::size_t camera,
                                                                 std::size_t frame, const SE3& map_T_tag) {
  const CameraModel& model = made.scene.cameras[camera].model;
  const SE3 map_T_cam = made.rig[frame] * made.cameras[camera];
  auto corners = visible_corners(model, map_T_cam.inverse() * map_T_tag, kRigTag_m);
  if (!corners || made.shape.readout_s == 0) return corners;
  for (std::size_t k = 0; k < 4; ++k) {
    for (int round = 0; round < 8; ++round) {
      const double late_s = ((*corners)[k].y() / model.height_px() - 0.5) * made.shape.readout_s;
      const SE3 then = rig_at(made.shape, static_cast<double>(frame) + late_s / made.shape.step_s);
      const auto px =
          model.project((then * made.cameras[camera]).inverse() * (map_T_tag * tag_corners(kRigTag_m)[k]));
      if (!px) return std::nullopt;
      (*corners)[k] = *px;
    }
  }
  return corners;
}

inline RigScene rig_scene(const RigShape& shape = {}) {
  RigScene made{.shape = shape};
  Random random(shape.seed);
  made.cameras = {SE3(), at(0.3, 0.02, 0, 0, 0.15, 0.05)};
  made.cameras.resize(shape.cameras);
  made.scene.bodies.push_back(
      {.name = "wall", .map_T_body = exactly(SE3()), .default_tag_size_m = kRigTag_m});
  made.scene.bodies.push_back({.name = "rig", .is_static = false});
  made.scene.default_body = 0;
  for (std::size_t c = 0; c < shape.cameras; ++c)
    made.scene.cameras.push_back(
        {.name = "cam" + std::to_string(c),
         .model =
             CameraModel::make(PinholeRadtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247}, 640, 480).value(),
         .body = 1,
         .body_T_cam = exactly(made.cameras[c]),
         .readout_s = shape.readout_s});
  for (std::size_t i = 0; i < shape.tags; ++i) {
    const auto x = static_cast<double>(i);
    made.tags.push_back(at(0.4 * x - 0.2 * static_cast<double>(shape.tags), 0.3 * std::fmod(x, 3) - 0.3,
                           2 + 0.05 * std::sin(x), 0.2 * std::sin(2 * x), 0.2 * std::cos(3 * x), 0.1 * x));
    made.scene.bodies[0].tags.push_back({rig_tag(i), kRigTag_m, {}});
  }
  made.scene.bodies[0].tags[0].body_T_tag = exactly(made.tags[0]);
  for (std::size_t f = 0; f < shape.frames; ++f) {
    made.rig.push_back(rig_at(shape, static_cast<double>(f)));
    SceneFrame frame{.stamp =
                         SensorTime(Duration(std::llround(1e9 * shape.step_s * static_cast<double>(f))))};
    for (std::size_t c = 0; c < shape.cameras; ++c) {
      SceneView view{.camera = c};
      for (std::size_t t = 0; t < shape.tags; ++t) {
        const auto corners = rig_corners(made, c, f, made.tags[t]);
        if (!corners) continue;
        TagDetection seen{.tag = rig_tag(t), .corners_px = *corners};
        for (Eigen::Vector2d& corner : seen.corners_px) {
          corner.x() += shape.noise_px * random.normal();
          corner.y() += shape.noise_px * random.normal();
        }
        view.detections.push_back(seen);
      }
      frame.views.push_back(view);
    }
    made.recording.frames.push_back(frame);
  }
  return made;
}

/// The problem of the scene, with every pose at the truth and every observation in use; corners have this
/// noise.
inline SceneMap true_scene_map(const RigScene& made, double sigma_px = 0.5,
                               RepeatedIds repeated = RepeatedIds::First) {
  SceneMap map{.scene = made.scene};
  map.scene.pixel_sigma_px = sigma_px;
  map.observations = observations_of(made.recording, map.scene, repeated);
  auto problem = scene_bundle(map.scene, made.recording, map.observations);
  EXPECT_TRUE(problem) << to_string(problem.error());
  map.problem = std::move(*problem);
  auto& poses = map.problem.bundle.poses;
  for (std::size_t c = 0; c < made.cameras.size(); ++c) poses[map.problem.cameras[c]].value = made.cameras[c];
  for (std::size_t f = 0; f < made.rig.size(); ++f) poses[map.problem.bodies[1][f]].value = made.rig[f];
  for (std::size_t t = 0; t < map.scene.bodies[0].tags.size(); ++t) {
    const auto number = static_cast<std::size_t>(map.scene.bodies[0].tags[t].id.number);
    if (number < made.tags.size()) poses[map.problem.tags[0][t]].value = made.tags[number];
  }
  map.placed.assign(poses.size(), 1);
  map.covariance.poses.assign(poses.size(), Matrix6::Zero());
  map.noise_px = sigma_px;
  return map;
}

}  // namespace waymark::test
