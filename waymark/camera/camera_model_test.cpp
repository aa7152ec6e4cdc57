#include "waymark/camera/camera_model.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(CameraModel, ProjectsAPinholeByHand) {
  const auto camera = CameraModel::make(PinholeRadtan{.fx = 100, .fy = 200, .cx = 32, .cy = 24}, 64, 48);
  ASSERT_TRUE(camera);
  const auto px = camera->project({0.1, -0.05, 2.0});
  ASSERT_TRUE(px);
  EXPECT_DOUBLE_EQ(px->x(), 37.0);
  EXPECT_DOUBLE_EQ(px->y(), 19.0);
  EXPECT_TRUE(camera->contains(*px));
  EXPECT_FALSE(camera->project({0.1, -0.05, -2.0}));
}

}  // namespace
}  // namespace waymark
