#include "waymark/pipeline/passed_tags.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

constexpr Hull kHull{.front_m = 0.2, .rear_m = 0.1, .width_m = 0.2, .height_m = 0.25};
constexpr TagId kTag{FamilyId::Tag36h11, 7};

SensorTime at_s(double seconds) { return SensorTime(Duration(std::llround(1e9 * seconds))); }

/// A tag that faces the path along x from its left side.
SE3 tag_at(double x_m, double clearance_m) {
  return {SO3::from_rpy(-std::numbers::pi / 2, 0, 0), {x_m, kHull.width_m / 2 + clearance_m, 0.1}};
}

TagBesideRobot seen_from(const SE2& odom_T_base, const SE3& odom_T_tag) {
  return {.tag = kTag, .size_m = 0.16, .base_T_tag = lift(odom_T_base).inverse() * odom_T_tag};
}

/// Drives along x from one place to another at 0.3 m/s, with odometry at 20 Hz.
double drive(PassedTags& passed, double from_s, double from_m, double to_m) {
  double t = from_s;
  for (double x_m = from_m; x_m <= to_m; x_m += 0.015, t += 0.05)
    passed.add(Odometry{.stamp = at_s(t), .odom_T_base = SE2(x_m, 0, 0)});
  return t;
}

TEST(PassedTags, AnImageIsPlacedAtItsTime) {
  for (const double late_s : {-0.03, 0.0, 0.3}) {
    PassedTags passed(kHull);
    const double observed_s = 1.01;
    const SE2 odom_T_base(0.3 * observed_s, 0, 0);
    const double now = drive(passed, 0, 0, 0.3 * (observed_s + late_s));
    passed.add(at_s(observed_s), {seen_from(odom_T_base, tag_at(1, 0.12))});
    drive(passed, now, 0.3 * now, 3);
    ASSERT_TRUE(passed.nearest()) << late_s;
    EXPECT_NEAR(passed.nearest()->clearance_m, 0.12, 1e-3) << late_s;
    EXPECT_NEAR(passed.nearest()->map_T_base.x(), 1, 0.3);
  }
}

TEST(PassedTags, TheNearestObservationCounts) {
  PassedTags passed(kHull);
  const double now = drive(passed, 0, 0, 0.5);
  const SE2 odom_T_base(0.4, 0, 0);
  passed.add(at_s(0.4 / 0.3), {seen_from(odom_T_base, tag_at(1, 0.12))});
  const SE2 from_afar(0.1, 0, 0);
  passed.add(at_s(0.1 / 0.3), {seen_from(from_afar, tag_at(1, 0.05))});
  drive(passed, now, 0.5, 3);
  EXPECT_NEAR(passed.nearest()->clearance_m, 0.12, 1e-3);
}

TEST(PassedTags, ADistantTagIsNotPassed) {
  PassedTags passed(kHull);
  const double now = drive(passed, 0, 0, 0.5);
  passed.add(at_s(1), {seen_from(SE2(0.3, 0, 0), tag_at(1.0, 1.3))});
  drive(passed, now, 0.5, 3);
  EXPECT_FALSE(passed.nearest());
}

TEST(PassedTags, AnAmbiguousPoseIsNotUsed) {
  PassedTags passed(kHull);
  const double now = drive(passed, 0, 0, 0.5);
  passed.add(at_s(1), {seen_from(SE2(0.3, 0, 0), tag_at(1, 0.12))});
  TagBesideRobot ambiguous = seen_from(SE2(0.4, 0, 0), tag_at(1, 0.05));
  ambiguous.ambiguity_ratio = 0.95;
  passed.add(at_s(0.4 / 0.3), {ambiguous});
  drive(passed, now, 0.5, 3);
  ASSERT_TRUE(passed.nearest());
  EXPECT_NEAR(passed.nearest()->clearance_m, 0.12, 1e-3);
}

TEST(PassedTags, PosesThatAreNotFiniteAreIgnored) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  PassedTags passed(kHull);
  const double now = drive(passed, 0, 0, 0.5);
  const TagBesideRobot misplaced{
      .tag = {FamilyId::Tag36h11, 8}, .size_m = 0.16, .base_T_tag = SE3(SO3(), {kNan, 0, 0})};
  passed.add(at_s(1), {misplaced, seen_from(SE2(0.3, 0, 0), tag_at(1, 0.12))});
  passed.add(Odometry{.stamp = at_s(now), .odom_T_base = SE2(kNan, 0, 0)});
  drive(passed, now + 0.05, 0.5, 3);
  ASSERT_TRUE(passed.nearest());
  EXPECT_EQ(passed.nearest()->tag, kTag);
  EXPECT_NEAR(passed.nearest()->clearance_m, 0.12, 1e-3);
  EXPECT_TRUE(std::isfinite(passed.nearest()->arc_length_m));
}

TEST(PassedTags, ObservationsFromBeforeAResetOfTheOdometryAreForgotten) {
  PassedTags passed(kHull);
  drive(passed, 0, 0, 0.5);
  passed.add(at_s(1), {seen_from(SE2(0.3, 0, 0), tag_at(1.2, 0.05))});
  passed.forget();
  drive(passed, 10, 0, 3);
  EXPECT_FALSE(passed.nearest());
}

TEST(PassedTags, ObservationsAreForgottenAfterALongDrive) {
  PassedTags passed(kHull);
  double now = drive(passed, 0, 0, 0.5);
  passed.add(at_s(1), {seen_from(SE2(0.3, 0, 0), tag_at(1.2, 0.12))});
  now = drive(passed, now, 0.5, 7);
  for (double x_m = 7; x_m >= 0; x_m -= 0.015, now += 0.05)  // back again, nearer to the tag by odometry
    passed.add(Odometry{.stamp = at_s(now), .odom_T_base = SE2(x_m, 0.1, 0)});
  EXPECT_NEAR(passed.nearest()->clearance_m, 0.12, 1e-3);
}

}  // namespace
}  // namespace waymark
