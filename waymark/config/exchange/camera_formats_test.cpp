// Tests of camera files as written by kalibr.
#include <array>
#include <chrono>
#include <string>
#include <variant>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/camera_texts.hpp"
#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/config/exchange/camera_file.hpp"

namespace waymark {
namespace {

using testing::camera_error;
using testing::exchanged;
using testing::kCamchain;
using testing::kCameraInfo;
using ::testing::SizeIs;
using ::testing::StartsWith;

std::string chain_error(const std::string& from, const std::string& to, const char* name = "cam1") {
  return camera_error(exchanged(kCamchain, from, to), name);
}

TEST(Camchain, ReadsACamchainOfKalibr) {
  const auto cameras = parse_cameras(kCamchain, "c.yaml");
  ASSERT_TRUE(cameras) << to_string(cameras.error());
  ASSERT_THAT(*cameras, SizeIs(2));
  const NamedCamera& first = cameras->at(0);
  EXPECT_EQ(first.name, "cam0");
  EXPECT_EQ(first.topic, "/t265/fisheye1/image_raw");
  EXPECT_EQ(first.imu_minus_cam_time_s, -0.0025);
  ASSERT_TRUE(first.cam_T_imu);
  EXPECT_EQ((*first.cam_T_imu)(1, 3), -0.02);
  EXPECT_EQ((*first.cam_T_imu)(0, 1), -1.0);
  const Equidistant fisheye{
      .fx = 286.7, .fy = 286.8, .cx = 421.4, .cy = 397.4, .k = {-0.01, 0.02, -0.003, 0.0004}};
  EXPECT_EQ(first.camera.projection(), CameraModel::Projection(fisheye));
  const NamedCamera& second = cameras->at(1);
  EXPECT_EQ(std::get<PinholeRadtan>(second.camera.projection()).cx, 320.0);
  EXPECT_FALSE(second.cam_T_imu);
  ASSERT_TRUE(second.cam_T_previous);
  EXPECT_EQ((*second.cam_T_previous)(0, 3), -0.064);
}

TEST(Camchain, RequiresTheChoiceOfACamera) {
  EXPECT_TRUE((camera_error(kCamchain)).starts_with("c.yaml:1: "));
  EXPECT_NE((camera_error(kCamchain)).find("2 cameras"), std::string::npos);
  testing::expect_on_page("config", camera_error(kCamchain));
  EXPECT_TRUE((camera_error(kCamchain, "cam2")).starts_with("c.yaml:1: "));
  testing::expect_on_page("config", camera_error(kCamchain, "cam2"));
  EXPECT_TRUE((camera_error(kCameraInfo, "cam0")).starts_with("c.yaml:1: "));
  testing::expect_on_page("config", camera_error(kCameraInfo, "cam0"));
  EXPECT_EQ(camera_error(kCameraInfo, "dabai"), "");
  EXPECT_EQ(camera_error(kCamchain, "cam1"), "");
}

TEST(Camchain, OnlyTheChosenCameraMustBeValid) {
  const std::string text = exchanged(kCamchain, "equidistant", "fov");
  EXPECT_EQ(camera_error(text, "cam1"), "");
  EXPECT_THAT(camera_error(text, "cam0"),
              StartsWith("c.yaml:10 (cam0.distortion_model): unknown distortion model 'fov'."));
  EXPECT_FALSE(parse_cameras(text, "c.yaml"));
}

TEST(Camchain, ReportsErrors) {
  EXPECT_TRUE((chain_error("rostopic", "rostopik", "cam0")).starts_with("c.yaml:13 (cam0.rostopik): "));
  testing::expect_on_page("config", chain_error("rostopic", "rostopik", "cam0"));
  EXPECT_TRUE((chain_error("  resolution: [640, 480]\n", "")).starts_with("c.yaml:16 (cam1.resolution): "));
  testing::expect_on_page("config", chain_error("  resolution: [640, 480]\n", ""));
  EXPECT_TRUE((chain_error("[640, 480]", "[640]")).starts_with("c.yaml:21 (cam1.resolution): "));
  EXPECT_NE((chain_error("[640, 480]", "[640]")).find("1 numbers"), std::string::npos);
  testing::expect_on_page("config", chain_error("[640, 480]", "[640]"));
  EXPECT_TRUE((chain_error("[640, 480]", "[640, 480.5]")).starts_with("c.yaml:21 (cam1.resolution[1]): "));
  EXPECT_NE((chain_error("[640, 480]", "[640, 480.5]")).find("480.5"), std::string::npos);
  testing::expect_on_page("config", chain_error("[640, 480]", "[640, 480.5]"));
  EXPECT_TRUE((chain_error("[500.0, 501.0, 319.5, 239.5]", "[500.0, 501.0, 319.5]"))
                  .starts_with("c.yaml:20 (cam1.intrinsics): "));
  EXPECT_NE((chain_error("[500.0, 501.0, 319.5, 239.5]", "[500.0, 501.0, 319.5]")).find("3 numbers"),
            std::string::npos);
  testing::expect_on_page("config", chain_error("[500.0, 501.0, 319.5, 239.5]", "[500.0, 501.0, 319.5]"));
  EXPECT_THAT(
      chain_error("[500.0,", "[-500.0,"),
      ::testing::AllOf(StartsWith("c.yaml:20 (cam1.intrinsics): fx: "), ::testing::HasSubstr("-500")));
  EXPECT_TRUE((chain_error("radtan", "radtn")).starts_with("c.yaml:19 (cam1.distortion_model): "));
  testing::expect_on_page("config", chain_error("radtan", "radtn"));
  EXPECT_TRUE((chain_error("radtan", "none")).starts_with("c.yaml:18 (cam1.distortion_coeffs): "));
  EXPECT_NE((chain_error("radtan", "none")).find("4 distortion"), std::string::npos);
  testing::expect_on_page("config", chain_error("radtan", "none"));
  EXPECT_TRUE((chain_error("camera_model: pinhole", "camera_model: omni", "cam0"))
                  .starts_with("c.yaml:8 (cam0.camera_model): "));
  testing::expect_on_page("config", chain_error("camera_model: pinhole", "camera_model: omni", "cam0"));
  EXPECT_TRUE((chain_error("camera_model: pinhole", "camera_model: pinhol", "cam0"))
                  .starts_with("c.yaml:8 (cam0.camera_model): "));
  testing::expect_on_page("config", chain_error("camera_model: pinhole", "camera_model: pinhol", "cam0"));
  EXPECT_TRUE((chain_error("[0.0, 0.0, 1.0, 0.03]", "[0.0, 0.0, -1.0, 0.03]", "cam0"))
                  .starts_with("c.yaml:3 (cam0.T_cam_imu): "));
  EXPECT_NE((chain_error("[0.0, 0.0, 1.0, 0.03]", "[0.0, 0.0, -1.0, 0.03]", "cam0")).find("[R t]"),
            std::string::npos);
  testing::expect_on_page("config", chain_error("[0.0, 0.0, 1.0, 0.03]", "[0.0, 0.0, -1.0, 0.03]", "cam0"));
  EXPECT_TRUE(
      (chain_error("  - [0.0, 0.0, 1.0, 0.03]\n", "", "cam0")).starts_with("c.yaml:3 (cam0.T_cam_imu): "));
  EXPECT_NE((chain_error("  - [0.0, 0.0, 1.0, 0.03]\n", "", "cam0")).find("4x4 matrix"), std::string::npos);
  testing::expect_on_page("config", chain_error("  - [0.0, 0.0, 1.0, 0.03]\n", "", "cam0"));
  EXPECT_TRUE((chain_error("cam1:", "Cam1: {}\ncam1:")).starts_with("c.yaml:15 (Cam1): "));
  testing::expect_on_page("config", chain_error("cam1:", "Cam1: {}\ncam1:"));
}

TEST(Camchain, WithoutDistortionNeedsNoCoefficients) {
  const std::string text = exchanged(exchanged(kCamchain, "radtan", "none"),
                                     "  distortion_coeffs: [-0.2, 0.1, 0.001, 0.002]\n", "");
  const auto camera = parse_camera(text, "c.yaml", "cam1");
  ASSERT_TRUE(camera) << to_string(camera.error());
  EXPECT_EQ(std::get<PinholeRadtan>(camera->camera.projection()).coefficients, 0);
}

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

TEST(OpencvYaml, AddsHalfAPixelOnReading) {
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

TEST(OpencvYaml, RoundTrips) {
  std::vector<CameraModel> all = models();
  all.push_back(fisheye());
  for (const CameraModel& camera : all) {
    const std::string text = to_opencv_yaml({.name = "cam", .camera = camera});
    const auto back = parse_camera(text, "c.yaml");
    ASSERT_TRUE(back) << to_string(back.error()) << text;
    EXPECT_EQ(back->camera, camera) << text;
  }
}

TEST(OpencvYaml, ReportsMissingKeys) {
  std::string text = to_opencv_yaml({.name = "cam", .camera = models().front()});
  text.replace(text.find("image_width"), 11, "image_breit");
  const auto camera = parse_camera(text, "c.yaml");
  ASSERT_FALSE(camera);
  EXPECT_THAT(to_string(camera.error()), HasSubstr("image_width"));
}

TEST(PhotonvisionJson, RoundTrips) {
  const CameraObservation seen{.image = "1.png",
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
    // PhotonVision supports five or eight coefficients.
    auto expected = std::get<PinholeRadtan>(camera.projection());
    auto found = std::get<PinholeRadtan>(back->camera.projection());
    found.coefficients = expected.coefficients;
    EXPECT_EQ(found, expected);
  }
  EXPECT_FALSE(to_photonvision_json({.name = "cam", .camera = fisheye()}));
}

using ::testing::HasSubstr;

std::string calibration(const std::string& more = "") {
  return R"({"resolution":{"width":1280.0,"height":720.0},
  "cameraIntrinsics":{"rows":3,"cols":3,"type":6,"data":[1011.5,0.0,645.25,0.0,1008.5,508.0,0.0,0.0,1.0]},
  "distCoeffs":{"rows":1,"cols":5,"type":6,"data":[0.137,-0.29,8.3E-4,-3.6E-4,0.09]})" +
         more + "}";
}

TEST(Photonvision, AddsHalfAPixelOnReading) {
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

TEST(Photonvision, SkipsMegabytesOfObservations) {
  std::string points;
  for (int i = 0; i < 200'000; ++i) points += R"({"x":1.5,"y":2.5,"z":[0,{"deep":1}]},)";
  const auto camera = parse_camera(
      calibration(R"(,"observations":[)" + points + R"({"x":0}],"calobjectSize":{"width":10})"), "c.json");
  ASSERT_TRUE(camera) << to_string(camera.error());
  EXPECT_EQ(camera->camera.width_px(), 1280);
}

TEST(Photonvision, ReportsErrors) {
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
