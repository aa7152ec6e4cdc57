#include "waymark/evaluation/tag_reprojection.hpp"

#include <gmock/gmock.h>

#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

const TagId kTag{FamilyId::Tag36h11, 3};
const SE3 kCamera = base_T_camera({.z_m = 0.2});

CameraModel camera() {
  return CameraModel::make(PinholeRadtan{.fx = 600, .fy = 600, .cx = 320, .cy = 240}, 640, 480).value();
}

/// A tag two metres ahead of the origin, at the height of the camera, readable from there.
TagMap map_of_one() { return {{{kTag, {SE3(body_R_optical(), Eigen::Vector3d(2, 0, 0.2)), 0.2, {}}}}}; }

TagFrame seen_from_origin(const Eigen::Vector2d& off_px) {
  const SE3 cam_T_tag = kCamera.inverse() * map_of_one().find(kTag)->map_T_tag;
  TagFrame frame{.stamp = SensorTime(std::chrono::seconds(1))};
  TagDetection seen{.tag = kTag};
  seen.corners_px = visible_corners(camera(), cam_T_tag, 0.2).value();
  for (auto& corner : seen.corners_px) corner += off_px;
  frame.detections.push_back(seen);
  return frame;
}

const Trajectory kStanding = {{SensorTime(std::chrono::milliseconds(900)), SE3()},
                              {SensorTime(std::chrono::milliseconds(1100)), SE3()}};

TEST(TagReprojection, IsWhatTheCornersAreOffBy) {
  const auto found = tag_reprojection({seen_from_origin({0.3, -0.4}), seen_from_origin({0.3, 0.4})},
                                      map_of_one(), kStanding, camera(), kCamera);
  ASSERT_EQ(found.size(), 1U);
  const TagReprojection& tag = found.at(kTag);
  EXPECT_EQ(tag.observations, 2U);
  EXPECT_NEAR(tag.rms_px, std::sqrt(0.25 / 2), 1e-9);
  EXPECT_NEAR(tag.mean_px.x(), 0.3, 1e-9);
  EXPECT_NEAR(tag.mean_px.y(), 0.0, 1e-9);
  EXPECT_NEAR(tag.largest_px, 0.5, 1e-9);
  EXPECT_NEAR(tag.nearest_m, 2, 1e-9);
}

TEST(TagReprojection, LeavesOutWhatCannotBePredicted) {
  TagFrame late = seen_from_origin({0, 0});
  late.stamp = SensorTime(std::chrono::seconds(9));
  TagFrame unmapped = seen_from_origin({0, 0});
  unmapped.detections[0].tag.number = 4;
  EXPECT_TRUE(tag_reprojection({late, unmapped}, map_of_one(), kStanding, camera(), kCamera).empty());
  EXPECT_TRUE(tag_reprojection({seen_from_origin({0, 0})}, map_of_one(), {}, camera(), kCamera).empty());
}

}  // namespace
}  // namespace waymark
