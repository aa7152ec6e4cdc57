#include "waymark/mapping/lap/floor_observations.hpp"

#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

constexpr TagId kTag{FamilyId::Tag36h11, 3};

/// A camera that looks ahead and slightly down.
SE3 looking_down() {
  const SO3 ahead = SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished());
  return {SO3::from_rpy(0, to_radians(10), 0) * ahead, {0.1, 0, 0.4}};
}

/// Observations of a tag by a robot that drives towards it and turns.
std::vector<ObservedFrame> seen(const SE3& map_T_tag) {
  std::vector<ObservedFrame> frames;
  for (int i = 0; i < 10; ++i) {
    const SE3 map_T_base = lift(SE2(0.1 * i, 0.03 * i, 0.02 * i - 0.1));
    ObservedFrame frame;
    frame.tags.push_back({.tag = kTag, .cam_T_tag = (map_T_base * looking_down()).inverse() * map_T_tag});
    frame.tags.back().covariance = PoseCovariance::Identity() * 1e-6;
    frames.push_back(frame);
  }
  return frames;
}

SO3 facing_the_robot() {
  return SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished());
}

TEST(AnchorStance, AnUprightTagIsTheDefault) {
  const auto stance = anchor_stance(seen({SO3::from_rpy(0, 0, 0.4) * facing_the_robot(), {3, 0.2, 0.5}}),
                                    kTag, looking_down());
  ASSERT_TRUE(stance);
  EXPECT_EQ(stance->kind, AnchorStance::Kind::Upright);
  EXPECT_LT((stance->map_T_anchor.inverse() * SE3(facing_the_robot(), Eigen::Vector3d::Zero())).log().norm(),
            1e-9);
  EXPECT_EQ(describe(*stance, kTag), "");
}

TEST(AnchorStance, ALeaningTagLeavesTheMapLevel) {
  // The tag leans back by 20 degrees about the map's y axis and is then rotated by 0.4 rad.
  const SO3 leaning = SO3::from_rpy(0, 0, 0.4) * SO3::from_rpy(0, -to_radians(20), 0) * facing_the_robot();
  const auto stance = anchor_stance(seen({leaning, {3, 0.2, 0.5}}), kTag, looking_down());
  ASSERT_TRUE(stance);
  EXPECT_EQ(stance->kind, AnchorStance::Kind::Leaning);
  EXPECT_NEAR(to_degrees(stance->tilt_rad), 20, 0.5);
  const Eigen::Vector3d normal = stance->map_T_anchor.rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(normal.y(), 0, 0.01) << "map x is the projection of the normal onto the floor";
  EXPECT_NEAR(std::abs(normal.z()), std::sin(to_radians(20)), 0.01);
  EXPECT_NE(describe(*stance, kTag).find("20 deg"), std::string::npos);
  testing::expect_on_page("map", describe(*stance, kTag));
}

TEST(AnchorStance, ATagOnTheFloorIsRecognised) {
  // The tag faces up, so its z axis, which points into the tag, points down.
  const SO3 lying = SO3::from_rpy(std::numbers::pi, 0, 0.7);
  const auto stance = anchor_stance(seen({lying, {2.2, 0.1, 0.0}}), kTag, looking_down());
  ASSERT_TRUE(stance);
  EXPECT_EQ(stance->kind, AnchorStance::Kind::Lying);
  EXPECT_NEAR((stance->map_T_anchor.rotation() * Eigen::Vector3d::UnitZ()).z(), -1, 1e-3);
  EXPECT_NEAR((stance->map_T_anchor.rotation() * Eigen::Vector3d::UnitX()).x(), 1, 1e-3);
  testing::expect_on_page("map", describe(*stance, kTag));
  EXPECT_FALSE(anchor_stance({}, kTag, looking_down()));
}

}  // namespace
}  // namespace waymark
