// Camera parameters as a vector.
#include "waymark/mapping/camera/camera_parameters.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(CameraParameters, EveryLensHasANameAndRoundTripsItsParameters) {
  for (const LensModel lens : lens_models()) {
    EXPECT_EQ(lens_model(to_string(lens)), lens);
    const auto count = static_cast<Eigen::Index>(parameter_names(lens).size());
    Eigen::VectorXd numbers = Eigen::VectorXd::Zero(count);
    numbers.head<4>() << 400, 410, 320, 240;
    const auto camera = camera_of(lens, numbers, 640, 480);
    ASSERT_TRUE(camera) << to_string(lens);
    EXPECT_LT((*camera->project({0, 0, 1}) - Eigen::Vector2d(320, 240)).norm(), 1e-12);
    numbers[0] = 0;
    EXPECT_FALSE(camera_of(lens, numbers, 640, 480));
  }
  EXPECT_FALSE(lens_model("wide"));
}

// Such a camera is accepted in a file, but cross-validation would prefer it, because it ignores marks outside
// its domain.
TEST(CameraParameters, ALensThatFoldsBeforeTheEdgeIsNotEstimated) {
  Eigen::VectorXd numbers = Eigen::VectorXd::Zero(8);
  numbers << 500, 500, 640, 360, -0.4, 0, 0, 0;
  EXPECT_FALSE(camera_of(LensModel::Radtan4, numbers, 1280, 720));
  EXPECT_TRUE(CameraModel::make(
      PinholeRadtan{.fx = 500, .fy = 500, .cx = 640, .cy = 360, .k = {-0.4}, .coefficients = 4}, 1280, 720));
}

}  // namespace
}  // namespace waymark
