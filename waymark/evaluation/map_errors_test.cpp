#include "waymark/evaluation/map_errors.hpp"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>

#include "waymark/geometry/planar.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;

SensorTime at(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

TEST(MapErrors, AreComputedWithoutAlignment) {
  TagMap truth;
  TagMap estimated;
  const SE3 moved(SO3::exp({0, 0, 0.02}), {0.3, 0.4, 0});
  for (int i = 0; i < 5; ++i) {
    const TagId id{.family = TagId{}.family, .number = i};
    truth.tags[id] = {.map_T_tag = SE3(SO3::exp({0.1 * i, 0.2, 0}), {1.0 * i, 0, 0}), .size_m = 0.1};
    estimated.tags[id] = truth.tags[id];
  }
  EXPECT_EQ(tag_map_errors(estimated, truth).rmse_m, 0);
  for (auto& [id, tag] : estimated.tags)
    tag.map_T_tag =
        SE3(moved.rotation() * tag.map_T_tag.rotation(), tag.map_T_tag.translation() + moved.translation());
  estimated.tags.erase(TagId{.family = TagId{}.family, .number = 4});
  const TagMapErrors errors = tag_map_errors(estimated, truth);
  EXPECT_EQ(errors.tags, 4U);
  EXPECT_EQ(errors.missing.size(), 1U);
  EXPECT_TRUE(errors.unknown.empty());
  EXPECT_NEAR(errors.rmse_m, 0.5, 1e-12);
  EXPECT_NEAR(errors.max_m, 0.5, 1e-12);
  EXPECT_NEAR(errors.orientation_rmse_deg, 0.02 * 180 / kPi, 1e-9);
}

TEST(MapErrors, CompareATrajectoryAtItsOwnStamps) {
  Trajectory truth;
  for (int i = 0; i <= 10; ++i) truth.push_back({at(i), lift(SE2(i, 0, 0))});
  const Trajectory estimated = {
      {at(-1), {}}, {at(2.5), lift(SE2(2.5, 0.1, 0))}, {at(7.25), lift(SE2(7.25, -0.1, 0.02))}, {at(11), {}}};
  const TrajectoryErrors errors = trajectory_errors(estimated, truth);
  EXPECT_EQ(errors.poses, 2U);
  EXPECT_NEAR(errors.rmse_m, 0.1, 1e-12);
  EXPECT_NEAR(errors.max_m, 0.1, 1e-12);
  EXPECT_NEAR(errors.orientation_rmse_deg, 0.02 / std::sqrt(2) * 180 / kPi, 1e-9);
  EXPECT_EQ(trajectory_errors({}, truth).poses, 0U);
  EXPECT_EQ(trajectory_errors(estimated, {}).poses, 0U);
}

const TagId kTag{FamilyId::Tag36h11, 3};
const SE3 kCamera = base_T_camera({.z_m = 0.2});

CameraModel camera() {
  return CameraModel::make(PinholeRadtan{.fx = 600, .fy = 600, .cx = 320, .cy = 240}, 640, 480).value();
}

/// A tag two metres in front of the origin, at camera height and visible from there.
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

TEST(TagReprojection, IsTheErrorOfTheCorners) {
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

TEST(TagReprojection, SkipsObservationsThatCannotBePredicted) {
  TagFrame late = seen_from_origin({0, 0});
  late.stamp = SensorTime(std::chrono::seconds(9));
  TagFrame unmapped = seen_from_origin({0, 0});
  unmapped.detections[0].tag.number = 4;
  EXPECT_TRUE(tag_reprojection({late, unmapped}, map_of_one(), kStanding, camera(), kCamera).empty());
  EXPECT_TRUE(tag_reprojection({seen_from_origin({0, 0})}, map_of_one(), {}, camera(), kCamera).empty());
}

}  // namespace
}  // namespace waymark
