#include "waymark/samples/tag_detection.hpp"

#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

TEST(Corners, TheCenterIsTheImageOfTheCenterUnderAnyHomography) {
  Random random(5);
  for (int round = 0; round < 100; ++round) {
    Eigen::Matrix3d H = Eigen::Matrix3d::Identity();
    for (Eigen::Index i = 0; i < 9; ++i) H(i) += 0.2 * random.normal();
    H(2, 2) = 3;  // keeps the square in front of the camera
    const auto image = [&](double x, double y) -> Eigen::Vector2d {
      return (H * Eigen::Vector3d(x, y, 1)).hnormalized();
    };
    const std::array<Eigen::Vector2d, 4> corners = {image(-1, -1), image(1, -1), image(1, 1), image(-1, 1)};
    EXPECT_LT((center_px(corners) - image(0, 0)).norm(), 1e-9) << round;
  }
}

TEST(Corners, CenterOfAQuadWithoutAreaIsItsMean) {
  const Eigen::Vector2d p(3, 4);
  EXPECT_EQ(center_px({p, p, p, p}), p);
  const Eigen::Vector2d q(5, 4);
  EXPECT_EQ(center_px({p, q, p, q}), Eigen::Vector2d(4, 4));
}

TEST(Corners, SideOfARectangle) {
  EXPECT_DOUBLE_EQ(mean_side_px({Eigen::Vector2d(0, 0), {4, 0}, {4, 2}, {0, 2}}), 3);
}

TEST(Corners, AreUsableUnlessMarkedAsUnreliable) {
  std::vector<TagDetection> tags(3);
  tags[1].tag.number = 7;
  tags[1].corner_state = CornerState::Unreliable;
  EXPECT_TRUE(usable_corners(tags[0]));
  EXPECT_TRUE(check_usable_corners(tags[0]));
  EXPECT_FALSE(usable_corners(tags[1]));
  EXPECT_EQ(count_unreliable(tags), 1U);
  const Status status = check_usable_corners(tags[1]);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(status.error().place.key, "tag36h11:7");
}

}  // namespace
}  // namespace waymark
