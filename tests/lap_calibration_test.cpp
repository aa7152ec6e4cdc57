// What a lap tells of its robot without a map: circuit24, a camera that sits elsewhere than the robot's file
// says.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <gmock/gmock.h>

#include "tests/support/circuit_lap.hpp"
#include "waymark/mapping/lap_calibration.hpp"
#include "waymark/samples/camera_body.hpp"

namespace waymark {
namespace {

using namespace test;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kDegrees = 57.29577951308232;

/// The file has the camera 3 cm and 2 degrees from where it sits.
LapInput with_a_wrong_file(const Lap& lap) {
  LapInput wrong = lap.input;
  const SE3& truth = lap.input.base_T_cam;
  wrong.base_T_cam = SE3(SO3::exp({0, 0, 2 / kDegrees}) * truth.rotation(),
                         truth.translation() + Eigen::Vector3d(0.024, -0.018, 0));
  return wrong;
}

TEST(LapCalibration, TwoSpeedsTellWhereTheCameraSits) {
  constexpr double kSigmas = 3.3;  // of a normal distribution, 0.999
  const int laps = std::getenv("WAYMARK_FULL") != nullptr ? 20 : 3;
  int inside = 0;
  int numbers = 0;
  for (int i = 0; i < laps; ++i) {
    const Lap lap = drive(static_cast<std::uint64_t>(201 + i), {.speed_m_s = 0.2, .second_speed_m_s = 0.6});
    const auto found = calibrate_by_lap(with_a_wrong_file(lap));
    ASSERT_TRUE(found) << to_string(found.error());
    const auto check = [&](const char* name, double truth, double largest_sigma) {
      const CalibratedValue& value = found->calibration.values.at(name);
      const double off = std::abs(value.value - truth);
      std::printf("  %s: off by %.5f, sigma %.5f\n", name, off, value.sigma);
      EXPECT_EQ(value.verdict, CalibrationVerdict::Known) << name;
      EXPECT_LT(value.sigma, largest_sigma) << name;
      EXPECT_LT(off, kSigmas * value.sigma) << name;
      inside += off < 1.96 * value.sigma ? 1 : 0;
      ++numbers;
    };
    const CameraMounting truth = camera_mounting(lap.input.base_T_cam);
    check("mounting_x_m", truth.x_m, 0.01);
    check("mounting_y_m", truth.y_m, 0.0025);
    check("mounting_yaw_rad", truth.yaw_rad, 0.2 / kDegrees);
    check("mounting_pitch_rad", truth.pitch_rad, 0.1 / kDegrees);
    check("mounting_roll_rad", truth.roll_rad, 0.1 / kDegrees);
    check("odometry_scale", 1 / 1.02, 0.002);
    check("side_slip_s", -0.03, 0.02);
    EXPECT_LT(std::abs(found->calibration.values.at("camera_latency_s").value), 0.005);
  }
  std::printf("%d of %d numbers in their 95 %% interval\n", inside, numbers);
}

TEST(LapCalibration, OneSpeedDoesNotTellAndSaysWhatToDrive) {
  const Lap lap = drive(211, {.speed_m_s = 0.3, .speed_wander = 0});
  const auto found = calibrate_by_lap(with_a_wrong_file(lap));
  ASSERT_TRUE(found) << to_string(found.error());
  const CalibratedValue& forward = found->calibration.values.at("mounting_x_m");
  EXPECT_EQ(forward.verdict, CalibrationVerdict::Unobservable) << forward.sigma;
  EXPECT_THAT(forward.advice, HasSubstr("Drive at two speeds, both turns"));
}

TEST(LapCalibration, TheMapNamesTheCameraThatSitsElsewhere) {
  const Lap lap = drive(212, {.speed_m_s = 0.2, .second_speed_m_s = 0.6});
  const LapInput wrong = with_a_wrong_file(lap);
  EXPECT_THAT(check_map(wrong, map_of(wrong)), Contains(HasSubstr("the camera seems to sit elsewhere")));
}

TEST(LapCalibration, WithoutOdometryThereIsNoBase) {
  LapInput lap = drive(213).input;
  lap.odometry.clear();
  const auto found = calibrate_by_lap(lap);
  ASSERT_FALSE(found);
  EXPECT_THAT(to_string(found.error()), HasSubstr("no odometry"));
}

}  // namespace
}  // namespace waymark
