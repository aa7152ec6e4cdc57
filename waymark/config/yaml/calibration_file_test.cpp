#include "waymark/config/yaml/calibration_file.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/line_cuts.hpp"
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

/// A calibration with the standard deviations and correlations of its camera.
Calibration correlated_calibration() {
  Calibration calibration = some_calibration();
  calibration.values["fy_px"] = {.value = 500.5, .sigma = 0.2};
  calibration.values["cx_px"] = {.value = 320.1, .sigma = 0.5};
  calibration.values["cy_px"] = {.value = 239.7, .sigma = 0.4};
  calibration.camera_correlations.resize(4, 4);
  calibration.camera_correlations << 1, 0.95, -0.1, 1.0 / 3,  //
      0.95, 1, -0.2, 0.3,                                     //
      -0.1, -0.2, 1, 0,                                       //
      1.0 / 3, 0.3, 0, 1;
  return calibration;
}

TEST(CalibrationFile, StoresTheCorrelationsOfTheCamera) {
  const Calibration written = correlated_calibration();
  const auto read = parse_calibration(to_yaml(written), "calibration.yaml");
  ASSERT_TRUE(read) << to_string(read.error()) << to_yaml(written);
  EXPECT_EQ(read->camera_correlations, written.camera_correlations);
  const IntrinsicsCovariance covariance = intrinsics_covariance(*read->camera, *read);
  ASSERT_EQ(covariance.rows(), 4);
  EXPECT_NEAR(covariance(0, 1), 0.3 * 0.2 * 0.95, 1e-15);
  EXPECT_NEAR(covariance(3, 3), 0.4 * 0.4, 1e-15);
  EXPECT_TRUE(is_covariance(covariance));
}

TEST(CalibrationFile, RejectsCutsAtLineEnds) {
  const std::string text = to_yaml(correlated_calibration());
  for (const std::string& cut : testing::cuts_at_line_ends(text))
    EXPECT_FALSE(parse_calibration(cut, "calibration.yaml")) << cut;
  const auto cut = parse_calibration(text.substr(0, text.find("camera_correlations:")), "calibration.yaml");
  ASSERT_FALSE(cut);
  EXPECT_EQ(cut.error().place.key, "value_count");
  std::string added = text;
  added.insert(added.find("  fx_px: {"), "  readout_s: {value: 0.015, sigma: 0.001, verdict: known}\n");
  const auto read = parse_calibration(added, "calibration.yaml");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_TRUE(parse_calibration(to_yaml(*read), "written"));
}

TEST(CalibrationFile, WithoutCorrelationsParametersAreIndependent) {
  Calibration calibration = correlated_calibration();
  calibration.camera_correlations.resize(0, 0);
  const auto read = parse_calibration(to_yaml(calibration), "calibration.yaml");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->camera_correlations.size(), 0);
  const IntrinsicsCovariance covariance = intrinsics_covariance(*read->camera, *read);
  ASSERT_EQ(covariance.rows(), 4);
  EXPECT_EQ(covariance(0, 1), 0);
  EXPECT_NEAR(covariance(1, 1), 0.2 * 0.2, 1e-15);
  calibration.values.clear();
  EXPECT_EQ(intrinsics_covariance(*calibration.camera, calibration).size(), 0) << "taken as exact";
}

TEST(CalibrationFile, RejectsCorrelationsThatDoNotBelongToTheCamera) {
  const std::string text = to_yaml(correlated_calibration());
  const auto changed = [&](const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    std::string other = text;
    other.replace(at, from.size(), to);
    const auto read = parse_calibration(other, "c.yaml");
    return read ? std::string("read") : to_string(read.error());
  };
  EXPECT_NE(changed("  fy_px: [0.95]", "  fy_px: [0.95, 1.0]").find("(camera_correlations.fy_px)"),
            std::string::npos);
  EXPECT_NE(changed("  fy_px: [0.95]\n", "").find("fy_px"), std::string::npos);
  EXPECT_NE(changed("  fy_px: [0.95]\n", "  k1: [0.95]\n").find("'k1'"), std::string::npos);
  EXPECT_NE(changed("[0.95]", "[1.01]").find("1.01 is not a correlation"), std::string::npos);
  EXPECT_NE(changed("[0.95]", "[.nan]").find("(camera_correlations.fy_px"), std::string::npos);
  EXPECT_NE(changed("[0.95]", "[-0.99]").find("positive semidefinite"), std::string::npos);
  EXPECT_NE(changed("sigma: 0.2", "sigma: 0").find("standard deviation of fy_px"), std::string::npos);
  Calibration without_camera = correlated_calibration();
  without_camera.camera.reset();
  EXPECT_FALSE(write_calibration("/dev/null", without_camera));
  Calibration short_matrix = correlated_calibration();
  short_matrix.camera_correlations = Eigen::MatrixXd::Identity(3, 3);
  EXPECT_FALSE(write_calibration("/dev/null", short_matrix));
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
