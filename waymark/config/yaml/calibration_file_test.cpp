#include "waymark/config/yaml/calibration_file.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

Calibration some_calibration() {
  Calibration calibration;
  calibration.camera =
      CameraModel::make(PinholeRadtan{.fx = 501.25, .fy = 500.5, .cx = 320.1, .cy = 239.7}, 640, 480).value();
  calibration.values["fx_px"] = {.value = 501.25, .sigma = 0.3};
  calibration.values["mounting_y_m"] = {.value = -0.027, .sigma = 1.0 / 3};
  calibration.values["odometry_scale"] = {.value = 1,
                                          .sigma = 0.1,
                                          .verdict = CalibrationVerdict::Unobservable,
                                          .advice = "Drive at two speeds: \"slow\", then fast."};
  calibration.provenance = {{"recording", "lap.mcap"}};
  return calibration;
}

TEST(CalibrationFile, ReadsBackWhatItWrote) {
  const Calibration written = some_calibration();
  const auto read = parse_calibration(to_yaml(written), "calibration.yaml");
  ASSERT_TRUE(read) << to_string(read.error()) << to_yaml(written);
  EXPECT_EQ(read->values, written.values);
  EXPECT_EQ(read->camera, written.camera);
  EXPECT_EQ(read->provenance, written.provenance);
  EXPECT_EQ(read->observable_value("mounting_y_m"), -0.027);
  EXPECT_FALSE(read->observable_value("odometry_scale"));
  EXPECT_FALSE(read->observable_value("yaw_scale"));
  const auto camera = parse_camera(to_yaml(written), "calibration.yaml");
  ASSERT_TRUE(camera) << to_string(camera.error());
  EXPECT_EQ(camera->camera, written.camera);
}

TEST(CalibrationFile, ReportsThePlaceOfErrors) {
  const auto error = [](const std::string& text) {
    const auto read = parse_calibration(text, "c.yaml");
    return read ? std::string("read") : to_string(read.error());
  };
  const std::string head = "format: waymark-calibration-1\n";
  EXPECT_NE(error("tags: []\n").find("c.yaml"), std::string::npos);
  EXPECT_NE(error("format: waymark-calibration-9\n").find("c.yaml:1 (format)"), std::string::npos);
  EXPECT_NE(error(head + "values: {yaw_sclae: {value: 1, sigma: 1, verdict: known}}\n").find("'yaw_scale'"),
            std::string::npos);
  EXPECT_NE(error(head + "values: {yaw_scale: {value: 1, sigma: -1, verdict: known}}\n")
                .find("(values.yaw_scale.sigma)"),
            std::string::npos);
  EXPECT_NE(error(head + "values: {yaw_scale: {value: 1, verdict: known}}\n").find("sigma"),
            std::string::npos);
  EXPECT_NE(error(head + "values: {yaw_scale: {value: .nan, sigma: 1, verdict: known}}\n").find("finite"),
            std::string::npos);
  EXPECT_NE(error(head + "values: {yaw_scale: {value: 1, sigma: 1, verdict: maybe}}\n").find("'maybe'"),
            std::string::npos);
  EXPECT_EQ(error(head), "read");
}

TEST(CalibrationFile, RejectsNonFiniteNumbers) {
  Calibration calibration;
  calibration.values["yaw_scale"] = {.value = std::nan("")};
  EXPECT_FALSE(write_calibration("/dev/null", calibration));
  calibration.values.clear();
  calibration.values["yaw"] = {.value = 1};
  EXPECT_FALSE(write_calibration("/dev/null", calibration));
}

TEST(CalibrationFile, ReplacesOnlyCalibratedPartsOfTheMounting) {
  const SE3 base_T_cam = base_T_camera({0.1, 0.02, 0.2, 0, 0.1, -0.05});
  Calibration calibration;
  calibration.values["mounting_y_m"] = {.value = -0.03};
  calibration.values["mounting_yaw_rad"] = {.value = 0.02};
  calibration.values["mounting_x_m"] = {.value = 9, .verdict = CalibrationVerdict::Unobservable};
  const CameraMounting mounting = camera_mounting(calibrated_mounting(base_T_cam, calibration));
  EXPECT_NEAR(mounting.x_m, 0.1, 1e-12);
  EXPECT_NEAR(mounting.y_m, -0.03, 1e-12);
  EXPECT_NEAR(mounting.pitch_rad, 0.1, 1e-12);
  EXPECT_NEAR(mounting.yaw_rad, 0.02, 1e-12);
}

}  // namespace
}  // namespace waymark
