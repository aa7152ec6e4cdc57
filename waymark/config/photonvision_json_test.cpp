#include <chrono>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/config/camera_file.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

std::string calibration(const std::string& more = "") {
  return R"({"resolution":{"width":1280.0,"height":720.0},
  "cameraIntrinsics":{"rows":3,"cols":3,"type":6,"data":[1011.5,0.0,645.25,0.0,1008.5,508.0,0.0,0.0,1.0]},
  "distCoeffs":{"rows":1,"cols":5,"type":6,"data":[0.137,-0.29,8.3E-4,-3.6E-4,0.09]})" +
         more + "}";
}

TEST(Photonvision, GainsHalfAPixelWhenRead) {
  const auto camera =
      parse_camera(calibration(R"(,"perViewErrors":[0.4],"standardDeviation":0.06)"), "c.json");
  ASSERT_TRUE(camera) << to_string(camera.error());
  EXPECT_EQ(camera->camera.width_px(), 1280);
  EXPECT_EQ(camera->camera.height_px(), 720);
  const PinholeRadtan expected{.fx = 1011.5,
                               .fy = 1008.5,
                               .cx = 645.75,
                               .cy = 508.5,
                               .k = {0.137, -0.29, 8.3e-4, -3.6e-4, 0.09},
                               .coefficients = 5};
  EXPECT_EQ(camera->camera.projection(), CameraModel::Projection(expected));
}

TEST(Photonvision, PassesOverMegabytesOfObservations) {
  std::string points;
  for (int i = 0; i < 200'000; ++i) points += R"({"x":1.5,"y":2.5,"z":[0,{"deep":1}]},)";
  const auto camera = parse_camera(
      calibration(R"(,"observations":[)" + points + R"({"x":0}],"calobjectSize":{"width":10})"), "c.json");
  ASSERT_TRUE(camera) << to_string(camera.error());
  EXPECT_EQ(camera->camera.width_px(), 1280);
}

TEST(Photonvision, SaysWhatIsWrong) {
  const auto lens = parse_camera(calibration(R"(,"lensmodel":"LENSMODEL_SPLINED_STEREOGRAPHIC")"), "c.json");
  ASSERT_FALSE(lens);
  EXPECT_THAT(to_string(lens.error()), HasSubstr("LENSMODEL_SPLINED"));
  std::string odd = calibration();
  odd.replace(odd.find("1280.0"), 6, "1280.5");
  const auto size = parse_camera(odd, "c.json");
  ASSERT_FALSE(size);
  EXPECT_THAT(to_string(size.error()), HasSubstr("resolution.width"));
  const auto twice = parse_camera(calibration(R"(,"resolution":{})"), "c.json");
  ASSERT_FALSE(twice);
  EXPECT_THAT(to_string(twice.error()), HasSubstr("twice"));
}

TEST(Photonvision, ReadsRealCalibrations) {
  WAYMARK_REAL_DATA(folder, "photonvision");
  const auto limelight = read_camera(folder / "limelight_1280_720.json");
  ASSERT_TRUE(limelight) << to_string(limelight.error());
  EXPECT_NEAR(std::get<PinholeRadtan>(limelight->camera.projection()).cx, 645.9955139388737, 1e-9);
  EXPECT_TRUE(read_camera(folder / "laptop_1280.json"));
}

}  // namespace
}  // namespace waymark
