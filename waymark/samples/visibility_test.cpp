#include "waymark/samples/visibility.hpp"

#include <numbers>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

const CameraModel& camera() {
  static const CameraModel model =
      CameraModel::make(PinholeRadtan{.fx = 400, .fy = 400, .cx = 320, .cy = 240}, 640, 480).value();
  return model;
}

TEST(Visibility, CornersOfATagInFrontAreUprightAndInOrder) {
  const auto corners = visible_corners(camera(), SE3(SO3(), {0, 0, 2}), 0.2);
  ASSERT_TRUE(corners);
  EXPECT_TRUE((*corners)[0].isApprox(Eigen::Vector2d(300, 220), 1e-12));
  EXPECT_TRUE((*corners)[2].isApprox(Eigen::Vector2d(340, 260), 1e-12));
}

TEST(Visibility, TagsThatADetectorCannotFindAreNotVisible) {
  const double pi = std::numbers::pi;
  EXPECT_FALSE(visible_corners(camera(), SE3(SO3(), {0, 0, -2}), 0.2)) << "behind";
  EXPECT_FALSE(visible_corners(camera(), SE3(SO3::exp({0, pi, 0}), {0, 0, 2}), 0.2)) << "facing away";
  EXPECT_FALSE(visible_corners(camera(), SE3(SO3::exp({0, 1.4, 0}), {0, 0, 2}), 0.2)) << "oblique";
  EXPECT_FALSE(visible_corners(camera(), SE3(SO3(), {0, 0, 6}), 0.2)) << "13 px";
  EXPECT_FALSE(visible_corners(camera(), SE3(SO3(), {1.5, 0, 2}), 0.2)) << "beyond the image edge";
  EXPECT_TRUE(visible_corners(camera(), SE3(SO3(), {1.4, 0, 2}), 0.2));
}

// Dense sampling of both bodies gives an upper bound on the distance; no pair of samples may be nearer than
// the result.
TEST(Clearance, AgreesWithBruteForce) {
  Random random(1);
  const Hull hull{.front_m = 0.16, .rear_m = 0.14, .width_m = 0.22, .height_m = 0.25};
  for (int trial = 0; trial < 40; ++trial) {
    const MappedTag tag{
        .map_T_tag = SE3(SO3::exp({random.normal(), random.normal(), random.normal()}),
                         {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(0, 0.6)}),
        .size_m = 0.16};
    double sampled = 1e9;
    constexpr int kSteps = 24;
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; j <= kSteps; ++j) {
        const Eigen::Vector3d p = tag.map_T_tag * Eigen::Vector3d((1.0 * i / kSteps - 0.5) * 0.16,
                                                                  (1.0 * j / kSteps - 0.5) * 0.16, 0);
        const Eigen::Vector3d low(-0.14, -0.11, 0);
        const Eigen::Vector3d high(0.16, 0.11, 0.25);
        sampled = std::min(sampled, (p - p.cwiseMax(low).cwiseMin(high)).norm());
      }
    }
    const double distance = clearance_m(hull, SE3(), tag);
    EXPECT_LE(distance, sampled + 1e-9);
    EXPECT_GE(distance, sampled - 0.16 / kSteps);
  }
}

TEST(Clearance, IsZeroInsideAndInfiniteWithoutTags) {
  const Hull hull{.front_m = 1, .rear_m = 1, .width_m = 2, .height_m = 1};
  EXPECT_NEAR(clearance_m(hull, SE3(), MappedTag{.map_T_tag = SE3(SO3(), {0, 0, 0.5}), .size_m = 0.1}), 0,
              1e-9);
  EXPECT_EQ(clearance_m(hull, SE3(), TagMap{}), std::numeric_limits<double>::infinity());
  EXPECT_NEAR(clearance_m(hull, SE3(), MappedTag{.map_T_tag = SE3(SO3(), {0, 0, 3}), .size_m = 0.1}), 2,
              1e-9);
}

}  // namespace
}  // namespace waymark
