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

}  // namespace
}  // namespace waymark
