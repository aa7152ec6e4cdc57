// Tests maps of points in the plane: their invariants, and whether the true parameters are recovered.
#include "waymark/mapping/lap/landmark_map.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/mapping/solver/block_system.hpp"

namespace waymark {
namespace {

constexpr double kPi = 3.14159265358979;

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

struct Drive {
  std::vector<PointFrame> frames{};
  std::vector<Odometry> odometry{};
  std::map<TagId, Eigen::Vector2d> truth{};  ///< in the base frame at the first key frame
};

/// Two laps around a rectangle with turns on the spot and eight points outside it. Odometry distances are off
/// by 2 % and turns by 8 %, and the sensor is 3 cm to the left of its assumed mounting.
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

TEST(LandmarkMap, CovarianceIsConsistent) {
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

TEST(LandmarkMap, WrongIdsAreRejected) {
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
  EXPECT_EQ(map->rarely_observed, std::vector{tag(77)});
}

TEST(LandmarkMap, ReportsMissingOdometryOrObservations) {
  Drive d = drive(3, 0.005);
  const auto no_wheels = map_landmarks(d.frames, {});
  ASSERT_FALSE(no_wheels);
  EXPECT_EQ(no_wheels.error().code, ErrorCode::NotFound);
  testing::expect_on_page("map", no_wheels.error());
  for (PointFrame& frame : d.frames) frame.points.clear();
  const auto nothing = map_landmarks(d.frames, d.odometry);
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::NotFound);
  testing::expect_on_page("map", nothing.error());
}

}  // namespace
}  // namespace waymark

namespace waymark::internal {
namespace {

struct Course {
  LandmarkProblem problem{};
  std::vector<Eigen::Vector3d> frames{};  ///< true poses
  std::vector<Eigen::Vector2d> points{};
};

/// A drive along bends and straights among points. Odometry and the sensor have this noise (none if 0), and
/// the search starts at the true values.
Course course(std::uint64_t seed, double noise) {
  Random random(seed);
  Course c;
  LandmarkProblem& p = c.problem;
  constexpr int kFrames = 60;
  constexpr int kPoints = 9;
  for (int i = 0; i < kPoints; ++i)
    c.points.emplace_back(1.5 * std::cos(0.7 * i), 1 + 1.5 * std::sin(0.7 * i));
  SE2 at;
  double yaw = 0;
  for (int f = 0; f < kFrames; ++f) {
    c.frames.emplace_back(at.x(), at.y(), yaw);
    for (int i = 0; i < kPoints; ++i) {
      if ((f + i) % 3 != 0) continue;
      const Eigen::Vector2d base_p = at.inverse() * c.points[static_cast<std::size_t>(i)];
      p.observations.push_back({static_cast<std::size_t>(f),
                                static_cast<std::size_t>(i),
                                {base_p + noise * Eigen::Vector2d(random.normal(), random.normal()),
                                 Eigen::Matrix2d::Identity() / 0.02}});
    }
    const SE2::Tangent twist = f % 20 < 10 ? SE2::Tangent(0.25, 0, 0.05) : SE2::Tangent(0.1, 0, 0.35);
    at = at * SE2::exp(twist);
    yaw += twist.z();
    if (f + 1 < kFrames) {
      const SE2::Tangent measured = twist + 0.2 * noise * SE2::Tangent(random.normal(), 0, random.normal());
      p.motions.push_back({static_cast<std::size_t>(f + 1), {measured, {200, 200, 200}}});
    }
  }
  p.frames = c.frames;
  p.points = c.points;
  p.scales_sigma = {0.1, 0.1};
  p.mounting_sigma = {0.05, 0.05, 0.05};
  return c;
}

void disturb(LandmarkProblem& problem, std::uint64_t seed, double by) {
  Random random(seed);
  for (std::size_t i = 1; i < problem.frames.size(); ++i)
    problem.frames[i] += by * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  for (Eigen::Vector2d& point : problem.points)
    point += by * Eigen::Vector2d(random.normal(), random.normal());
}

TEST(LandmarkProblem, FindsTheTruthWithoutNoiseFromADistantStart) {
  Course c = course(1, 0);
  disturb(c.problem, 2, 0.1);
  const auto [steps, converged] = solve(c.problem, 0, 50);
  EXPECT_TRUE(converged);
  EXPECT_LT(steps, 50);
  EXPECT_LT(accumulate(c.problem, 0, nullptr), 1e-10);
  for (std::size_t i = 0; i < c.points.size(); ++i)
    EXPECT_LT((c.problem.points[i] - c.points[i]).norm(), 1e-6) << i;
  for (std::size_t i = 0; i < c.frames.size(); ++i)
    EXPECT_LT((c.problem.frames[i] - c.frames[i]).norm(), 1e-6) << i;
}

TEST(LandmarkProblem, TheSameMinimumFromEveryStart) {
  Course reference = course(3, 0.01);
  solve(reference.problem, 0, 50);
  const double least = accumulate(reference.problem, 0, nullptr);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Course c = course(3, 0.01);
    disturb(c.problem, seed, 0.08);
    EXPECT_TRUE(solve(c.problem, 0, 50).second);
    EXPECT_NEAR(accumulate(c.problem, 0, nullptr), least, 1e-5 * least) << seed;
  }
}

TEST(LandmarkProblem, EstimatesOdometryScalesAndTheSensorMounting) {
  Course c = course(4, 0);
  for (PlaneMotion& motion : c.problem.motions)
    motion.factor.twist = {motion.factor.twist.x() / 1.06, 0, motion.factor.twist.z() / 0.93};
  const SE2 base_X_sensor(0.03, -0.02, 0.04);
  for (PointObservation& seen : c.problem.observations)
    seen.factor.base_p = base_X_sensor.inverse() * seen.factor.base_p;
  c.problem.scales_sigma.setConstant(10);
  c.problem.mounting_sigma.setConstant(10);
  EXPECT_TRUE(solve(c.problem, 0, 50).second);
  EXPECT_NEAR(c.problem.scales.x(), 1.06, 1e-4);
  EXPECT_NEAR(c.problem.scales.y(), 0.93, 1e-4);
  EXPECT_LT((c.problem.mounting - Eigen::Vector3d(0.03, -0.02, 0.04)).norm(), 1e-3);
}

TEST(LandmarkProblem, TheOrderOfObservationsDoesNotMatter) {
  Course c = course(5, 0.01);
  Course mixed = c;
  std::ranges::reverse(mixed.problem.observations);
  solve(c.problem, 0, 50);
  solve(mixed.problem, 0, 50);
  for (std::size_t i = 0; i < c.points.size(); ++i)
    EXPECT_LT((c.problem.points[i] - mixed.problem.points[i]).norm(), 1e-7) << i;
}

TEST(LandmarkProblem, TheFrameDoesNotMatter) {
  Course c = course(6, 0.01);
  const double before = accumulate(c.problem, 0, nullptr);
  const SE2 by(3, -7, 2.1);
  for (Eigen::Vector3d& x : c.problem.frames) {
    const SE2 moved = by * SE2(x.x(), x.y(), x.z());
    x = {moved.x(), moved.y(), x.z() + 2.1};
  }
  for (Eigen::Vector2d& point : c.problem.points) point = by * point;
  EXPECT_NEAR(accumulate(c.problem, 0, nullptr), before, 1e-8 * before);
}

TEST(LandmarkProblem, ARobustLossIgnoresOutliers) {
  Course c = course(7, 0.005);
  for (std::size_t i = 0; i < c.problem.observations.size(); i += 15)
    c.problem.observations[i].factor.base_p += Eigen::Vector2d(1, -0.5);
  Course plain = c;
  solve(c.problem, 6, 50);
  solve(plain.problem, 0, 50);
  double robust_m = 0;
  double plain_m = 0;
  for (std::size_t i = 0; i < c.points.size(); ++i) {
    robust_m = std::max(robust_m, (c.problem.points[i] - c.points[i]).norm());
    plain_m = std::max(plain_m, (plain.problem.points[i] - c.points[i]).norm());
  }
  EXPECT_LT(robust_m, 0.03);
  EXPECT_GT(plain_m, 2 * robust_m);
}

TEST(LandmarkProblem, UnusedObservationsHaveNoEffect) {
  Course c = course(8, 0.01);
  Course more = c;
  PointObservation wrong = c.problem.observations.front();
  wrong.factor.base_p += Eigen::Vector2d(5, 5);
  wrong.used = false;
  more.problem.observations.push_back(wrong);
  solve(c.problem, 0, 50);
  solve(more.problem, 0, 50);
  for (std::size_t i = 0; i < c.points.size(); ++i)
    EXPECT_EQ(c.problem.points[i], more.problem.points[i]) << i;
}

TEST(LandmarkProblem, TheGradientIsTheSlopeOfTheCost) {
  Course c = course(9, 0.05);
  BlockSystem system = system_of(c.problem);
  for (double robust : {0.0, 6.0}) {
    accumulate(c.problem, robust, &system);
    constexpr double kStep = 1e-6;
    const auto slope = [&](double& number) {
      const double at = number;
      number = at + kStep;
      const double above = accumulate(c.problem, robust, nullptr);
      number = at - kStep;
      const double below = accumulate(c.problem, robust, nullptr);
      number = at;
      return (above - below) / (2 * kStep);
    };
    const auto g = [&](int unknown, int k) { return system.gradient()[system.offset(unknown) + k]; };
    const double scale = 1e-4 * (1 + system.gradient().cwiseAbs().maxCoeff());
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(slope(c.problem.frames[20][k]), g(c.problem.of_frame(20), k), scale);
      EXPECT_NEAR(slope(c.problem.mounting[k]), g(c.problem.of_mounting(), k), scale);
    }
    for (int k = 0; k < 2; ++k) {
      EXPECT_NEAR(slope(c.problem.points[4][k]), g(c.problem.of_point(4), k), scale);
      EXPECT_NEAR(slope(c.problem.scales[k]), g(c.problem.of_scales(), k), scale);
    }
  }
}

}  // namespace
}  // namespace waymark::internal
