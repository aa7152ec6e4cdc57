#pragma once

#include <vector>

#include <gtest/gtest.h>

#include "tests/support/tag_views.hpp"
#include "waymark/pose/multi_tag_pose.hpp"

namespace waymark::testing {

inline constexpr double kSigma = 0.1;
inline constexpr MultiTagOptions kOptions{.corner_sigma_px = kSigma};

/// A camera in a map, with the tags in its view.
struct MappedView {
  CameraModel camera = plain_camera();
  SE3 map_T_cam{};
  TagMap map{};
  std::vector<TagDetection> seen{};
};

inline TagId id(int number) { return {FamilyId::Tag36h11, number}; }

inline SE3 random_pose(Random& random, double size = 3.0) {
  const Eigen::Vector3d phi(random.normal(), random.normal(), random.normal());
  return {SO3::exp(phi), size * Eigen::Vector3d(random.normal(), random.normal(), random.normal())};
}

inline constexpr ViewRange kViews{
    .min_size_px = 25, .max_size_px = 100, .max_tilt_deg = 60, .max_off_axis = 0.35};

inline MappedView random_scene(Random& random, int tags, double sigma_px = kSigma,
                               const ViewRange& views = kViews) {
  MappedView scene{.map_T_cam = random_pose(random)};
  for (int i = 0; i < tags; ++i) {
    const double size = i % 2 == 0 ? kTagSize : kTagSize / 2;
    SE3 cam_T_tag = random_view(random, views, size);
    scene.map.tags[id(i)] = {.map_T_tag = scene.map_T_cam * cam_T_tag, .size_m = size};
    scene.seen.push_back(with_noise(see_tag(scene.camera, cam_T_tag, size, i).value(), sigma_px, random));
  }
  return scene;
}

inline MultiTagPose estimate(const MappedView& scene, const MultiTagOptions& options = kOptions) {
  auto pose = estimate_camera_pose(scene.seen, scene.map, scene.camera, options);
  EXPECT_TRUE(pose) << to_string(pose.error());
  return pose.value();
}

/// Moves a tag away from its pose in the map.
inline void displace(MappedView& scene, int number, Random& random, double metres = 0.2) {
  SE3& map_T_tag = scene.map.tags.at(id(number)).map_T_tag;
  const Eigen::Vector3d by =
      metres * Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
  map_T_tag = SE3(map_T_tag.rotation(), map_T_tag.translation() + by);
}

}  // namespace waymark::testing
