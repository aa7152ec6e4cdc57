#include "waymark/mapping/lap/landmark_map.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

constexpr double kPi = 3.14159265358979;

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

struct Drive {
  std::vector<PointFrame> frames{};
  std::vector<Odometry> odometry{};
  std::map<TagId, Eigen::Vector2d> truth{};  ///< in the frame of the first base
};

/// Twice round a rectangle with turns on the spot, eight points outside it; wheels 2 % and turns 8 % off, the
/// sensor 3 cm to the left of where it is assumed.
Drive drive(std::uint64_t seed, double noise_m) {
  Drive d;
  const std::vector<Eigen::Vector2d> places = {{2, 0.3},    {2, -0.3},   {1.6, 1.7},  {1, 1.7},
                                               {-0.8, 1.3}, {-0.8, 0.7}, {0.2, -0.7}, {0.8, -0.7}};
  for (std::size_t i = 0; i < places.size(); ++i) d.truth[tag(static_cast<int>(i))] = places[i];
  Random random(seed);
  SE2 truth;
  SE2 odom;
  std::int64_t ms = 0;
  const auto step = [&](double forward, double turn) {
    truth = truth * SE2::exp({forward, 0, turn});
    odom = odom *
           SE2::exp({forward / 1.02 + 0.0005 * random.normal(), 0, turn / 0.92 + 0.001 * random.normal()});
    ms += 40;
    const SensorTime stamp{std::chrono::milliseconds(ms)};
    d.odometry.push_back({stamp, odom});
    PointFrame frame{stamp};
    for (const auto& [id, map_p] : d.truth) {
      const Eigen::Vector2d base_p = truth.inverse() * map_p - Eigen::Vector2d(0, 0.03);
      const bool in_view = base_p.x() > 0.2 && std::abs(base_p.y()) < 0.6 * base_p.x() && base_p.norm() < 2.2;
      if (in_view)
        frame.points.push_back({id, base_p + noise_m * Eigen::Vector2d(random.normal(), random.normal())});
    }
    d.frames.push_back(frame);
  };
  step(0, 0);
  for (int side = 0; side < 8; ++side) {
    for (int i = 0; i < 50; ++i) step((side % 2 == 0 ? 1.3 : 1.0) / 50, 0);
    for (int i = 0; i < 30; ++i) step(0, kPi / 2 / 30);
  }
  return d;
}

TEST(LandmarkMap, FindsPointsScalesAndMounting) {
  const Drive d = drive(1, 0.005);
  const auto map = map_landmarks(d.frames, d.odometry);
  ASSERT_TRUE(map) << to_string(map.error());
  EXPECT_TRUE(map->converged);
  ASSERT_EQ(map->points.size(), d.truth.size());
  for (const auto& [id, point] : map->points) {
    const Eigen::Vector2d error = point.map_p - d.truth.at(id);
    EXPECT_LT(error.norm(), 0.05);
    EXPECT_LT(error.dot(point.covariance.inverse() * error), 13.8) << "0.999 quantile of chi-square";
  }
  EXPECT_NEAR(map->base_X_assumed.y(), 0.03, 0.005);
  EXPECT_NEAR(map->scales.distance, 1.02, 0.01);
  EXPECT_NEAR(map->scales.yaw, 0.92, 0.01);
}

TEST(LandmarkMap, ItsCovarianceMeansWhatItSays) {
  double chi2 = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Drive d = drive(seed, 0.01);
    const auto map = map_landmarks(d.frames, d.odometry);
    ASSERT_TRUE(map);
    for (const auto& [id, point] : map->points) {
      const Eigen::Vector2d error = point.map_p - d.truth.at(id);
      chi2 += error.dot(point.covariance.inverse() * error);
      count += 2;
    }
  }
  EXPECT_GT(chi2 / count, 0.2);
  EXPECT_LT(chi2 / count, 2.0);
}

TEST(LandmarkMap, WrongIdsAreLeftOut) {
  Drive d = drive(2, 0.005);
  Random random(9);
  for (PointFrame& frame : d.frames) {
    for (SeenPoint& seen : frame.points) {
      if (random.uniform(0, 1) < 0.1) seen.tag.number = static_cast<int>(random.uniform(0, 7.99));
    }
  }
  d.frames[50].points.push_back({tag(77), {1, 0}});
  d.frames[60].points.push_back({tag(1), {NAN, 0}});
  const auto map = map_landmarks(d.frames, d.odometry);
  ASSERT_TRUE(map);
  for (const auto& [id, point] : map->points) EXPECT_LT((point.map_p - d.truth.at(id)).norm(), 0.02);
  EXPECT_EQ(map->hardly_seen, std::vector{tag(77)});
}

TEST(LandmarkMap, SaysWhatIsMissing) {
  Drive d = drive(3, 0.005);
  const auto no_wheels = map_landmarks(d.frames, {});
  ASSERT_FALSE(no_wheels);
  EXPECT_NE(to_string(no_wheels.error()).find("odometry"), std::string::npos);
  for (PointFrame& frame : d.frames) frame.points.clear();
  const auto nothing = map_landmarks(d.frames, d.odometry);
  ASSERT_FALSE(nothing);
  EXPECT_NE(to_string(nothing.error()).find("nothing was seen"), std::string::npos);
}

}  // namespace
}  // namespace waymark
