// Camera files as kalibr writes them.
#include <array>
#include <string>
#include <variant>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/camera_texts.hpp"
#include "waymark/config/camera_file.hpp"

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

TEST(Camchain, ReadsWhatKalibrWrites) {
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

TEST(Camchain, AsksWhichCameraIsMeant) {
  EXPECT_EQ(camera_error(kCamchain), "c.yaml:1: the file holds 2 cameras. Choose one of cam0, cam1.");
  EXPECT_EQ(camera_error(kCamchain, "cam2"), "c.yaml:1: no camera 'cam2' in the file. There is cam0, cam1.");
  EXPECT_EQ(camera_error(kCameraInfo, "cam0"), "c.yaml:1: no camera 'cam0' in the file. There is dabai.");
  EXPECT_EQ(camera_error(kCameraInfo, "dabai"), "");
  EXPECT_EQ(camera_error(kCamchain, "cam1"), "");
}

TEST(Camchain, OnlyTheChosenCameraMustBeUsable) {
  const std::string text = exchanged(kCamchain, "equidistant", "fov");
  EXPECT_EQ(camera_error(text, "cam1"), "");
  EXPECT_THAT(camera_error(text, "cam0"),
              StartsWith("c.yaml:10 (cam0.distortion_model): unknown distortion model 'fov'."));
  EXPECT_FALSE(parse_cameras(text, "c.yaml"));
}

TEST(Camchain, SaysWhatIsWrong) {
  EXPECT_EQ(chain_error("rostopic", "rostopik", "cam0"),
            "c.yaml:13 (cam0.rostopik): unknown key 'rostopik'. Did you mean 'rostopic'?");
  EXPECT_EQ(chain_error("  resolution: [640, 480]\n", ""),
            "c.yaml:16 (cam1.resolution): 'resolution' is missing. Add `resolution:` with its value.");
  EXPECT_EQ(chain_error("[640, 480]", "[640]"), "c.yaml:21 (cam1.resolution): 1 numbers where 2 are needed");
  EXPECT_EQ(chain_error("[640, 480]", "[640, 480.5]"),
            "c.yaml:21 (cam1.resolution[1]): '480.5' is not a whole number");
  EXPECT_EQ(chain_error("[500.0, 501.0, 319.5, 239.5]", "[500.0, 501.0, 319.5]"),
            "c.yaml:20 (cam1.intrinsics): 3 numbers where 4 are needed");
  EXPECT_THAT(chain_error("[500.0,", "[-500.0,"),
              StartsWith("c.yaml:20 (cam1.intrinsics): fx: the focal length -500 is not possible."));
  EXPECT_EQ(chain_error("radtan", "radtn"),
            "c.yaml:19 (cam1.distortion_model): unknown distortion model 'radtn'. Did you mean 'radtan'?");
  EXPECT_EQ(chain_error("radtan", "none"),
            "c.yaml:18 (cam1.distortion_coeffs): 4 distortion coefficients, but the model 'none' has 0. "
            "4 coefficients belong to plumb_bob, radtan, equidistant, fisheye.");
  EXPECT_EQ(chain_error("camera_model: pinhole", "camera_model: omni", "cam0"),
            "c.yaml:8 (cam0.camera_model): the camera model 'omni' is not supported. Calibrate with "
            "pinhole-radtan, or "
            "pinhole-equi for a fisheye.");
  EXPECT_EQ(chain_error("camera_model: pinhole", "camera_model: pinhol", "cam0"),
            "c.yaml:8 (cam0.camera_model): unknown camera model 'pinhol'. Did you mean 'pinhole'?");
  EXPECT_EQ(chain_error("[0.0, 0.0, 1.0, 0.03]", "[0.0, 0.0, -1.0, 0.03]", "cam0"),
            "c.yaml:3 (cam0.T_cam_imu): not a rotation and a translation. Its rows are [R t] with a rotation "
            "R, and [0, 0, 0, "
            "1].");
  EXPECT_EQ(chain_error("  - [0.0, 0.0, 1.0, 0.03]\n", "", "cam0"),
            "c.yaml:3 (cam0.T_cam_imu): not a 4x4 matrix. Give four rows of four numbers.");
  EXPECT_EQ(chain_error("cam1:", "Cam1: {}\ncam1:"),
            "c.yaml:15 (Cam1): unknown key 'Cam1'. Did you mean 'cam1'?");
}

TEST(Camchain, WithoutDistortionNeedsNoCoefficients) {
  const std::string text = exchanged(exchanged(kCamchain, "radtan", "none"),
                                     "  distortion_coeffs: [-0.2, 0.1, 0.001, 0.002]\n", "");
  const auto camera = parse_camera(text, "c.yaml", "cam1");
  ASSERT_TRUE(camera) << to_string(camera.error());
  EXPECT_EQ(std::get<PinholeRadtan>(camera->camera.projection()).coefficients, 0);
}

}  // namespace
}  // namespace waymark
