#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/config/camera_file.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

CameraModel model(const CameraModel::Projection& projection) {
  return CameraModel::make(projection, 1280, 720).value();
}

std::vector<CameraModel> models() {
  return {model(PinholeRadtan{.fx = 1011.5,
                              .fy = 1008.25,
                              .cx = 645.7531,
                              .cy = 358.3301,
                              .k = {0.137, -0.29, 8.3e-4, -3.6e-4},
                              .coefficients = 4}),
          model(PinholeRadtan{.fx = 1011.5,
                              .fy = 1008.25,
                              .cx = 645.7531,
                              .cy = 358.3301,
                              .k = {0.137, -0.29, 8.3e-4, -3.6e-4, 0.09},
                              .coefficients = 5}),
          model(PinholeRadtan{.fx = 900.125,
                              .fy = 901,
                              .cx = 640.1,
                              .cy = 360.7,
                              .k = {0.3, -0.05, 1e-4, -2e-4, 0.01, 0.4, 0.02, 0.001},
                              .coefficients = 8})};
}
CameraModel fisheye() {
  return model(
      Equidistant{.fx = 400.5, .fy = 401.25, .cx = 639.9, .cy = 361.1, .k = {-0.02, 0.01, -0.004, 0.001}});
}

TEST(OpencvYaml, GainsHalfAPixelWhenRead) {
  const auto camera = parse_camera(
      "%YAML:1.0\n---\ncalibration_time: \"today\"\nimage_width: 640\nimage_height: 480\ncamera_matrix: "
      "!!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 5.0e+02, 0., 319.25, 0., 501., 239.75, "
      "0.,\n"
      "       0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: "
      "[ 0.1, "
      "-0.2, 0., 0., 0.05 ]\navg_reprojection_error: 0.2\n",
      "out.yml");
  ASSERT_TRUE(camera) << to_string(camera.error());
  const PinholeRadtan expected{
      .fx = 500, .fy = 501, .cx = 319.75, .cy = 240.25, .k = {0.1, -0.2, 0, 0, 0.05}, .coefficients = 5};
  EXPECT_EQ(camera->camera.projection(), CameraModel::Projection(expected));
  EXPECT_EQ(camera->camera.width_px(), 640);
}

TEST(OpencvYaml, ReadsBackWhatItWrote) {
  std::vector<CameraModel> all = models();
  all.push_back(fisheye());
  for (const CameraModel& camera : all) {
    const std::string text = to_opencv_yaml({.name = "cam", .camera = camera});
    const auto back = parse_camera(text, "c.yaml");
    ASSERT_TRUE(back) << to_string(back.error()) << text;
    EXPECT_EQ(back->camera, camera) << text;
  }
}

TEST(OpencvYaml, SaysWhatIsMissing) {
  std::string text = to_opencv_yaml({.name = "cam", .camera = models().front()});
  text.replace(text.find("image_width"), 11, "image_breit");
  const auto camera = parse_camera(text, "c.yaml");
  ASSERT_FALSE(camera);
  EXPECT_THAT(to_string(camera.error()), HasSubstr("image_width"));
}

TEST(PhotonvisionJson, ReadsBackWhatItWrote) {
  const CameraObservation seen{.picture = "1.png",
                               .cam_T_target = SE3({}, {0.1, 0, 1}),
                               .target_points_m = {{0, 0, 0}},
                               .seen_px = {{10.5, 20.5}},
                               .errors_px = {{0.25, -0.5}},
                               .used = {true}};
  for (const CameraModel& camera : models()) {
    const auto text = to_photonvision_json({.name = "cam", .camera = camera}, {seen});
    ASSERT_TRUE(text) << to_string(text.error());
    EXPECT_THAT(*text, HasSubstr(R"("locationInImageSpace":[{"x":10.0,"y":20.0}])"));
    const auto back = parse_camera(*text, "c.json");
    ASSERT_TRUE(back) << to_string(back.error()) << *text;
    EXPECT_EQ(back->camera.width_px(), 1280);
    // PhotonVision knows five coefficients or eight.
    auto expected = std::get<PinholeRadtan>(camera.projection());
    auto found = std::get<PinholeRadtan>(back->camera.projection());
    found.coefficients = expected.coefficients;
    EXPECT_EQ(found, expected);
  }
  EXPECT_FALSE(to_photonvision_json({.name = "cam", .camera = fisheye()}));
}

}  // namespace
}  // namespace waymark
