// Tests of the small headers in this room: time, angles and order statistics.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/base/random.hpp"
#include "waymark/base/time.hpp"

namespace waymark {
namespace {

template <class A, class B>
concept Subtracts = requires(A a, B b) { a - b; };

TEST(Time, StampsOfDifferentClocksDoNotSubtract) {
  static_assert(Subtracts<SensorTime, SensorTime>);
  static_assert(!Subtracts<SensorTime, HostTime>);
  EXPECT_DOUBLE_EQ(to_seconds(SensorTime(Duration(1'500'000'000)) - SensorTime()), 1.5);
}

TEST(Angles, DegreesAndRadiansRoundTrip) {
  EXPECT_DOUBLE_EQ(to_radians(180), std::acos(-1.0));
  for (const double angle_rad : {-7.0, 0.0, 0.3})
    EXPECT_NEAR(to_radians(to_degrees(angle_rad)), angle_rad, 1e-15);
}

TEST(OrderStatistics, MatchSortedValues) {
  Random random(5);
  for (std::size_t n = 1; n < 40; ++n) {
    std::vector<double> values(n);
    for (double& value : values) value = std::round(random.uniform(0, 20));
    std::vector<double> sorted = values;
    std::ranges::sort(sorted);
    EXPECT_EQ(median(values), sorted[n / 2]);
    EXPECT_EQ(quantile(values, 0), sorted.front());
    EXPECT_EQ(quantile(values, 1), sorted.back());
    EXPECT_EQ(quantile(values, 0.95), sorted[static_cast<std::size_t>(0.95 * static_cast<double>(n - 1))]);
  }
  EXPECT_EQ(median(std::vector<double>{}), 0);
  EXPECT_EQ(quantile(std::vector<double>{}, 0.5), 0);
}

}  // namespace
}  // namespace waymark
