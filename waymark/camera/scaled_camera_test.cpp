// A calibration for pictures of another size.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/camera/camera_model.hpp"

namespace waymark {
namespace {

CameraModel webcam() {
  return CameraModel::make(
             PinholeRadtan{
                 .fx = 600, .fy = 602, .cx = 318, .cy = 244, .k = {0.1, -0.2, 1e-3, 2e-3}, .coefficients = 4},
             640, 480)
      .value();
}

TEST(ScaledCamera, ProjectsToTheScaledPixel) {
  const CameraModel fisheye =
      CameraModel::make(Equidistant{.fx = 300, .fy = 301, .cx = 322, .cy = 238, .k = {0.01, -0.002, 0, 0}},
                        640, 480)
          .value();
  for (const CameraModel& camera : {webcam(), fisheye}) {
    const auto twice = scaled_camera(camera, 1280, 960);
    ASSERT_TRUE(twice);
    EXPECT_EQ(twice->width_px(), 1280);
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.1, -0.2, 1), Eigen::Vector3d(-0.3, 0.2, 0.9)})
      EXPECT_LT((*twice->project(p) - 2 * *camera.project(p)).norm(), 1e-9);
    EXPECT_EQ(scaled_camera(*twice, 640, 480).value(), camera);
  }
  EXPECT_TRUE(scaled_camera(webcam(), 853, 640)) << "rounded";
  const auto cropped = scaled_camera(webcam(), 1280, 720);
  ASSERT_FALSE(cropped);
  EXPECT_THAT(to_string(cropped.error()), ::testing::HasSubstr("640x480 does not scale to 1280x720"));
  EXPECT_FALSE(scaled_camera(webcam(), 0, 0));
  EXPECT_FALSE(scaled_camera(webcam(), -640, -480));
}

}  // namespace
}  // namespace waymark
