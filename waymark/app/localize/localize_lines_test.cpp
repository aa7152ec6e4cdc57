#include "waymark/app/localize/localize_lines.hpp"

#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace waymark {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

SensorTime at_s(double seconds) {
  return SensorTime(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds)));
}

TEST(EstimateLine, ContainsPoseAndStandardDeviations) {
  LocalizationEstimate estimate{.stamp = at_s(1700000000.5),
                                .map_T_base = SE2(1.25, -2.5, std::numbers::pi / 2)};
  estimate.covariance = Eigen::Vector3d(0.04 * 0.04, 0.03 * 0.03, 0.01 * 0.01).asDiagonal();
  const std::string line = estimate_line(3, estimate);
  EXPECT_THAT(line, HasSubstr("3.0 s: x 1.250 m, y -2.500 m, heading 90.0 deg, within 0.040 m and 0.57 deg"));
  EXPECT_THAT(line, Not(HasSubstr("uncertain")));
  const json value = json(to_json(fields(EstimateMoment{at_s(1700000001), estimate})));
  EXPECT_NEAR(value["pose"]["yaw_rad"].get<double>(), std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(value["pose"]["position_sigma_m"].get<double>(), 0.04, 1e-12);
  EXPECT_NEAR(value["pose"]["yaw_sigma_rad"].get<double>(), 0.01, 1e-12);
  EXPECT_NEAR(value["now_s"].get<double>() - value["pose"]["stamp_s"].get<double>(), 0.5, 1e-6);
  EXPECT_EQ(value["pose"]["certain"], true);
  estimate.certain = false;
  EXPECT_THAT(estimate_line(3, estimate), HasSubstr(", uncertain\n"));
  EXPECT_EQ(json(to_json(fields(EstimateMoment{at_s(1), estimate})))["pose"]["certain"], false);
}

TEST(EstimateLine, HasNoPoseWithoutAnEstimate) {
  EXPECT_THAT(estimate_line(0, std::nullopt), HasSubstr("unknown"));
  EXPECT_TRUE(json(to_json(fields(EstimateMoment{at_s(1), std::nullopt})))["pose"].is_null());
}

TEST(MomentLine, ContainsTheLargestStandardDeviation) {
  CameraMoment moment{.stamp = at_s(5), .age = std::chrono::milliseconds(40), .tags = 2};
  Uncertain<SE3> pose{.mean = SE3(SO3::from_rpy(0.1, -0.2, 0.3), Eigen::Vector3d(1, 2, 3))};
  // Correlated, so that the worst direction is not along any axis.
  Eigen::Matrix3d position;
  position << 5e-4, 4e-4, 0, 4e-4, 5e-4, 0, 0, 0, 1e-4;
  pose.covariance.setZero();
  pose.covariance.topLeftCorner<3, 3>() = position;
  moment.map_T_body = pose;
  const json value = json(to_json(fields(moment)));
  EXPECT_NEAR(value["pose"]["position_sigma_m"].get<double>(), 0.03, 1e-9);
  EXPECT_NEAR(value["age_ms"].get<double>(), 40, 1e-9);
  const auto q = value["pose"]["rotation_xyzw"].get<std::vector<double>>();
  EXPECT_NEAR(
      (SO3::from_quaternion(Eigen::Quaterniond(q[3], q[0], q[1], q[2])).inverse() * pose.mean.rotation())
          .log()
          .norm(),
      0, 1e-12);
  const std::string line = moment_line(0, moment);
  EXPECT_THAT(line,
              HasSubstr("x 1.000 m, y 2.000 m, z 3.000 m, roll 5.7 deg, pitch -11.5 deg, yaw 17.2 deg"));
  EXPECT_THAT(line, HasSubstr("within 0.030 m, from 2 tags"));
}

TEST(MomentLine, GivesTheReasonForAMissingPose) {
  EXPECT_THAT(moment_line(1, {.stamp = at_s(1), .tags = 0}), HasSubstr("no tags"));
  EXPECT_THAT(moment_line(1, {.stamp = at_s(1), .tags = 1, .why = "two poses"}),
              HasSubstr("unknown, two poses"));
  EXPECT_TRUE(json(to_json(fields(CameraMoment{.stamp = at_s(1), .tags = 1})))["pose"].is_null());
}

}  // namespace
}  // namespace waymark
