// Calibration from a lap of circuit24 without a map; the camera mounting differs from the robot file.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <gmock/gmock.h>

#include "tests/support/circuit_lap.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/mapping/lap/lap_calibration.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

using namespace test;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kDegrees = 57.29577951308232;

/// The mounting in the file is 3 cm and 2 degrees off.
LapInput with_a_wrong_file(const Lap& lap) {
  LapInput wrong = lap.input;
  const SE3& truth = lap.input.base_T_cam;
  wrong.base_T_cam = SE3(SO3::exp({0, 0, 2 / kDegrees}) * truth.rotation(),
                         truth.translation() + Eigen::Vector3d(0.024, -0.018, 0));
  return wrong;
}

/// Two laps with bends to both sides, alternating between 0.3 and 1 m/s: about 75 s.
DriverOptions bends_at_two_speeds() {
  return {.speed_m_s = 0.3,
          .second_speed_m_s = 1.0,
          .lateral_wander_m = 0.3,
          .wander_time_s = 1.5,
          .overlap_m = 16};
}

/// Compares estimates with the ground truth over seeds.
class Tally {
 public:
  /// The error is below `largest_off` and consistent with its standard deviation.
  void check(const Calibration& found, const char* name, double truth, double largest_off) {
    constexpr double kSigmas = 3.3;  // of a normal distribution, 0.999
    const CalibratedValue& value = found.values.at(name);
    const double off = std::abs(value.value - truth);
    std::printf("  %s: off by %.5f, sigma %.5f\n", name, off, value.sigma);
    EXPECT_EQ(value.verdict, CalibrationVerdict::Known) << name;
    EXPECT_LT(off, largest_off) << name;
    EXPECT_LT(off, kSigmas * value.sigma) << name;
    inside_ += off < 1.96 * value.sigma ? 1 : 0;
    ++numbers_;
  }
  void expect_95_percent() const {
    std::printf("%d of %d parameters in their 95 %% interval\n", inside_, numbers_);
    const double sigma = std::sqrt(0.95 * 0.05 * numbers_);
    EXPECT_GT(inside_, 0.95 * numbers_ - 3 * sigma);
  }

 private:
  int inside_ = 0;
  int numbers_ = 0;
};

TEST(LapCalibration, TwoSpeedsDetermineTheCameraMounting) {
  const int laps = std::getenv("WAYMARK_FULL") != nullptr ? 20 : 3;
  Tally tally;
  for (int i = 0; i < laps; ++i) {
    SCOPED_TRACE(::testing::Message() << "seed " << 201 + i);
    const Lap lap = drive(static_cast<std::uint64_t>(201 + i), bends_at_two_speeds());
    const auto found = calibrate_by_lap(with_a_wrong_file(lap));
    ASSERT_TRUE(found) << to_string(found.error());
    const CameraMounting truth = camera_mounting(lap.input.base_T_cam);
    tally.check(found->calibration, "mounting_x_m", truth.x_m, 0.005);
    tally.check(found->calibration, "mounting_y_m", truth.y_m, 0.005);
    tally.check(found->calibration, "mounting_yaw_rad", truth.yaw_rad, 0.2 / kDegrees);
    tally.check(found->calibration, "mounting_pitch_rad", truth.pitch_rad, 0.2 / kDegrees);
    tally.check(found->calibration, "mounting_roll_rad", truth.roll_rad, 0.2 / kDegrees);
    tally.check(found->calibration, "odometry_scale", 1 / 1.02, 0.002);
    tally.check(found->calibration, "yaw_scale", 1, 0.005);
    tally.check(found->calibration, "side_slip_s", -0.03, 0.02);
    tally.check(found->calibration, "camera_latency_s", 0, 0.003);
    // The gyro is read every 20 ms, at the end of the 20 ms it represents, and averages over the last 5 ms.
    tally.check(found->calibration, "turn_lead_s", 0.0075, 0.003);
    tally.check(found->calibration, "odometry_yaw_bias_rad_s", 0.002, 0.001);
  }
  tally.expect_95_percent();
}

/// Late images change only the estimated camera latency.
TEST(LapCalibration, LateImagesGiveTheSameCalibration) {
  constexpr double kCameraLatency_s = 0.06;
  DriverOptions once = bends_at_two_speeds();
  once.overlap_m = 1;
  const LapInput on_time = with_a_wrong_file(drive(214, once));
  LapInput late = on_time;
  for (TagFrame& frame : late.frames) frame.stamp += std::chrono::milliseconds(60);
  const auto a = calibrate_by_lap(on_time);
  const auto b = calibrate_by_lap(late);
  ASSERT_TRUE(a && b);
  for (const auto& [name, value] : a->calibration.values) {
    const CalibratedValue& other = b->calibration.values.at(name);
    const double later = name == "camera_latency_s" ? kCameraLatency_s : 0;
    EXPECT_NEAR(other.value - later, value.value, 0.5 * value.sigma) << name;
    EXPECT_NEAR(other.sigma / value.sigma, 1, 0.1) << name;
  }
  ASSERT_EQ(b->map.trajectory.size(), a->map.trajectory.size());
  EXPECT_EQ(b->map.trajectory.front().stamp, a->map.trajectory.front().stamp + std::chrono::milliseconds(60));
}

/// A less informative lap has larger standard deviations, and errors stay consistent with them.
TEST(LapCalibration, ALessInformativeLapIsConsistent) {
  Tally tally;
  for (int i = 0; i < 3; ++i) {
    const Lap lap = drive(static_cast<std::uint64_t>(201 + i), {.speed_m_s = 0.2, .second_speed_m_s = 0.6});
    const auto found = calibrate_by_lap(with_a_wrong_file(lap));
    ASSERT_TRUE(found) << to_string(found.error());
    const CameraMounting truth = camera_mounting(lap.input.base_T_cam);
    tally.check(found->calibration, "mounting_x_m", truth.x_m, 0.03);
    tally.check(found->calibration, "mounting_y_m", truth.y_m, 0.005);
    tally.check(found->calibration, "mounting_yaw_rad", truth.yaw_rad, 0.6 / kDegrees);
    tally.check(found->calibration, "camera_latency_s", 0, 0.005);
  }
  tally.expect_95_percent();
}

TEST(LapCalibration, ASingleSpeedIsReportedWithAdvice) {
  const Lap lap = drive(211, {.speed_m_s = 0.3, .speed_wander = 0});
  const auto found = calibrate_by_lap(with_a_wrong_file(lap));
  ASSERT_TRUE(found) << to_string(found.error());
  const CalibratedValue& forward = found->calibration.values.at("mounting_x_m");
  EXPECT_EQ(forward.verdict, CalibrationVerdict::Unobservable) << forward.sigma;
  EXPECT_THAT(forward.advice, HasSubstr("speed"));
  testing::expect_on_page("calibrate", forward.advice);
}

TEST(LapCalibration, MapChecksReportAWrongMounting) {
  const Lap lap = drive(212, {.speed_m_s = 0.2, .second_speed_m_s = 0.6});
  const LapInput wrong = with_a_wrong_file(lap);
  EXPECT_THAT(check_map(wrong, map_of(wrong)), Contains(HasSubstr("camera mounting")));
}

TEST(LapCalibration, FailsWithoutOdometry) {
  LapInput lap = drive(213).input;
  lap.odometry.clear();
  const auto found = calibrate_by_lap(lap);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::NotFound);
  testing::expect_on_page("calibrate", found.error());
}

}  // namespace
}  // namespace waymark
