#include "waymark/localization/tag_fix.hpp"

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

/// Four tags on a wall in front of the robot, observed from a pose on the floor.
struct TagWall {
  PinholeRadtan lens{.fx = 440, .fy = 440, .cx = 320, .cy = 240, .k = {}, .coefficients = 0};
  MountedSensor sensor{CameraModel::make(lens, 640, 480).value(), SE3(body_R_optical(), {0.08, 0, 0.18})};
  TagMap map{};
  Landmarks landmarks{};
  TagWatch watch{Landmarks{}};
  RiekfOptions options{};
  SE2 truth{0.3, -0.1, 0.15};
  Eigen::Vector3d tilt_rad{0, 0, 0};  ///< roll and pitch

  TagWall() {
    for (int i = 0; i < 4; ++i)
      map.tags[{.number = i}] = {.map_T_tag = SE3(body_R_optical(), {2.2 + 0.3 * i, -0.7 + 0.5 * i, 0.3}),
                                 .size_m = 0.16};
    landmarks = Landmarks(map);
    watch = TagWatch(landmarks);
  }

  /// Observations of the tags [0, count) with corners that have this standard deviation; the first tag is
  /// moved by `moved_m` along y.
  [[nodiscard]] std::vector<Observation> seen(int count, Random& random, double sigma_px,
                                              double moved_m = 0) const {
    std::vector<Observation> all;
    for (const auto& [id, tag] : map.tags) {
      if (id.number >= count) break;
      const Eigen::Vector3d moved(0, id.number == 0 ? moved_m : 0, 0);
      const SE3 map_T_tag(tag.map_T_tag.rotation(), tag.map_T_tag.translation() + moved);
      const SE3 map_T_cam = lift(truth) * SE3(SO3::exp(tilt_rad), {0, 0, 0}) * sensor.base_T_sensor;
      auto corners = visible_corners(*sensor.camera, map_T_cam.inverse() * map_T_tag, tag.size_m);
      if (!corners) continue;
      for (Eigen::Vector2d& corner : *corners) {
        const double x = random.normal();
        const double y = random.normal();
        corner += sigma_px * Eigen::Vector2d(x, y);
      }
      if (auto observation =
              observation_of(TagDetection{.tag = id, .corners_px = *corners}, landmarks, sensor, options))
        all.push_back(*observation);
    }
    return all;
  }
  [[nodiscard]] std::optional<TagFix> fix(const std::vector<Observation>& all, const SE2& near) const {
    return fix_of(all, landmarks, watch, sensor, options, near);
  }
};

TEST(TagFix, DoesNotDependOnTheStartOfTheSearch) {
  const TagWall wall;
  Random random(1);
  const auto seen = wall.seen(4, random, 0);
  ASSERT_EQ(seen.size(), 4U);
  for (const SE2& off : {SE2(0, 0, 0), SE2(0.3, -0.3, 0.2), SE2(-0.4, 0.2, -0.3)}) {
    const auto fix = wall.fix(seen, wall.truth * off);
    ASSERT_TRUE(fix);
    EXPECT_LT((fix->map_T_base.translation() - wall.truth.translation()).norm(), 1e-3);
    EXPECT_NEAR(fix->map_T_base.yaw(), wall.truth.yaw(), 1e-3);
    EXPECT_EQ(fix->tags, 4);
  }
}

TEST(TagFix, IsRobustToOneMovedTag) {
  const TagWall wall;
  Random random(2);
  const auto fix = wall.fix(wall.seen(4, random, 0.2, 0.2), wall.truth);
  ASSERT_TRUE(fix);
  EXPECT_LT((fix->map_T_base.translation() - wall.truth.translation()).norm(), 0.03);
}

TEST(TagFix, CovarianceCoversCornersTiltAndTagPositions) {
  TagWall wall;
  wall.options.corner_sigma_px = 0.3;
  wall.options.tag_sigma_m = 1e-6;
  wall.options.tag_sigma_rad = 1e-6;
  Random random(3);
  double nees = 0;
  constexpr int kDraws = 300;
  for (int i = 0; i < kDraws; ++i) {
    wall.tilt_rad = {0.02 * random.normal(), 0.02 * random.normal(), 0};
    const auto fix = wall.fix(wall.seen(2, random, 0.3), wall.truth);
    ASSERT_TRUE(fix);
    const SE2& at = fix->map_T_base;
    const Eigen::Vector3d off(at.x() - wall.truth.x(), at.y() - wall.truth.y(), at.yaw() - wall.truth.yaw());
    nees += off.dot(fix->covariance.inverse() * off) / kDraws;
  }
  EXPECT_NEAR(nees, 3, 0.8);
  const double corners_alone = wall.fix(wall.seen(2, random, 0.3), wall.truth)->covariance.trace();
  wall.options.tag_sigma_m = 0.01;
  EXPECT_GT(wall.fix(wall.seen(2, random, 0.3), wall.truth)->covariance.trace(), corners_alone + 1e-5);
}

// Wheels that push against an obstacle make the robot pitch on its springs, but its position on the floor is
// still correct.
TEST(TagFix, ToleratesATiltOfTheRobot) {
  for (const Eigen::Vector3d& tilt_rad : {Eigen::Vector3d(0, 0.02, 0), Eigen::Vector3d(-0.02, -0.02, 0)}) {
    TagWall wall;
    wall.tilt_rad = tilt_rad;
    Random random(3);
    const auto fix = wall.fix(wall.seen(2, random, 0.3), wall.truth);
    ASSERT_TRUE(fix);
    EXPECT_LT((fix->map_T_base.translation() - wall.truth.translation()).norm(), 0.03);
    const double variance_m2 = fix->covariance(0, 0) + fix->covariance(1, 1);
    EXPECT_LT(variance_m2, 0.04 * 0.04);
  }
}

TEST(TagFix, NoFixWithoutTags) {
  const TagWall wall;
  EXPECT_FALSE(wall.fix({}, wall.truth));
}

// A tag that was once moved but is now fixed still shows the motion of the robot if no other tag is in view.
TEST(TagFix, UsesASuspectedTagOnlyIfItIsAlone) {
  TagWall wall;
  for (int i = 0; i < 20; ++i) {
    wall.watch.add({.landmark = 0, .map_p_implied = {2, -0.5}});
    wall.watch.confirm();
  }
  ASSERT_FALSE(wall.watch.usable(0));
  Random random(4);
  const auto before = wall.fix(wall.seen(1, random, 0, 0.1), wall.truth);
  EXPECT_EQ(wall.fix(wall.seen(4, random, 0, 0.1), wall.truth)->tags, 3)
      << "tags not under suspicion are preferred";
  const SE2 moved(0.2, 0.02, 0.05);
  wall.truth = wall.truth * moved;
  const auto after = wall.fix(wall.seen(1, random, 0, 0.1), wall.truth);
  ASSERT_TRUE(before && after);
  const SE2 found = before->map_T_base.inverse() * after->map_T_base;
  EXPECT_LT((found.translation() - moved.translation()).norm(), 0.01);
  EXPECT_NEAR(found.yaw(), moved.yaw(), 0.005);
}

}  // namespace
}  // namespace waymark
