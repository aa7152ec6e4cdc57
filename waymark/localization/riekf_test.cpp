// Tests the filter: derivatives, invariance, order, and agreement with a textbook filter.
#include "waymark/localization/riekf.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "tests/support/numeric_jacobian.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/localization/observation.hpp"
#include "waymark/localization/timeline.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

SE3 optical(double x, double y) { return {body_R_optical(), {x, y, 0.2}}; }

MountedSensor mounted_sensor() {
  const PinholeRadtan lens{.fx = 440, .fy = 445, .cx = 320, .cy = 240, .k = {}, .coefficients = 0};
  return {CameraModel::make(lens, 640, 480).value(), optical(0.1, -0.02)};
}

/// Tags in front of a robot near the origin that is heading along x.
TagMap three_tags() {
  TagMap map;
  for (int i = 0; i < 3; ++i) {
    const SE3 place = lift(SE2(2.0 + 0.3 * i, 0.6 * (i - 1), 0.3 * (i - 1)));
    map.tags[{.number = i}] = {.map_T_tag = place * SE3(body_R_optical(), {0, 0, 0.3}), .size_m = 0.16};
  }
  return map;
}

TagDetection seen_from(const SE2& map_T_base, int number) {
  const MappedTag tag = *three_tags().find({.number = number});
  const SE3 cam_T_map = (lift(map_T_base) * mounted_sensor().base_T_sensor).inverse();
  TagDetection detection{.tag = {.number = number}};
  const auto corners = tag_corners(tag.size_m);
  for (std::size_t i = 0; i < 4; ++i)
    detection.corners_px[i] = *mounted_sensor().camera->project(cam_T_map * tag.map_T_tag * corners[i]);
  return detection;
}

/// Observations of every kind, made from a pose.
std::vector<Observation> observations(const SE2& map_T_base, const Landmarks& map) {
  const RiekfOptions options;
  std::vector<Observation> all;
  all.push_back(*observation_of(seen_from(map_T_base, 0), map, mounted_sensor(), options));
  const SE3 cam_T_map = (lift(map_T_base) * mounted_sensor().base_T_sensor).inverse();
  all.push_back(*observation_of(SeenTagPose{{.number = 1}, cam_T_map * map[1].map_T_tag}, map,
                                mounted_sensor(), options));
  const Eigen::Vector2d p = (map_T_base * project_to_plane(mounted_sensor().base_T_sensor)).inverse() *
                            Eigen::Vector2d(map[2].map_T_tag.translation().head<2>());
  all.push_back(*observation_of(RangeBearing{{}, 2, p.norm(), std::atan2(p.y(), p.x())}, map,
                                mounted_sensor(), options));
  return all;
}

std::vector<Matrix6> zero(int count) {
  return std::vector<Matrix6>(static_cast<std::size_t>(count), Matrix6::Zero());
}

RiekfOptions exact_map() {
  RiekfOptions options;
  options.tag_sigma_m = options.tag_sigma_rad = options.mounting_sigma_m = options.mounting_sigma_rad = 0;
  return options;
}

TEST(Observation, ResidualIsZeroAtTheTruePose) {
  const Landmarks map(three_tags());
  const SE2 X(0.1, -0.2, 0.15);
  for (const Observation& s : observations(X, map))
    EXPECT_LT(linearise(s, map, mounted_sensor(), X)->residual.norm(), 1e-9);
}

TEST(Observation, DerivativesMatchNumericOnes) {
  const TagMap tags = three_tags();
  const Landmarks map(tags);
  const SE2 X(0.1, -0.2, 0.15);
  const SE2 near = SE2::exp({0.02, -0.03, 0.04}) * X;
  for (const Observation& s : observations(X, map)) {
    const Linearised z = *linearise(s, map, mounted_sensor(), near);
    const auto pose = testing::numeric_jacobian<8, 3>(
        [&](const Eigen::Vector3d& xi) {
          return linearise(s, map, mounted_sensor(), plus(xi, near))->residual;
        },
        Eigen::Vector3d::Zero().eval(), 1e-4);
    EXPECT_LT((pose - z.H_pose).norm(), 1e-5 * (1 + z.H_pose.norm())) << static_cast<int>(s.kind);
    const auto tag = testing::numeric_jacobian<8, 6>(
        [&](const SE3::Tangent& e) {
          TagMap moved = tags;
          for (auto& [id, m] : moved.tags)
            m.map_T_tag =
                SE3(SO3::exp(e.tail<3>()) * m.map_T_tag.rotation(), m.map_T_tag.translation() + e.head<3>());
          return linearise(s, Landmarks(moved), mounted_sensor(), near)->residual;
        },
        SE3::Tangent::Zero().eval(), 1e-4);
    Eigen::Matrix<double, 8, 6> planar = tag;
    if (s.kind != ObservationKind::Corners)
      planar.middleCols<3>(2).setZero();  // components that cannot be observed on a floor
    EXPECT_LT((planar - z.H_tag).norm(), 1e-5 * (1 + z.H_tag.norm())) << static_cast<int>(s.kind);
    if (s.kind == ObservationKind::PlanarPose)
      continue;  // for this kind, the mounting acts on the measurement
    const auto mount = testing::numeric_jacobian<8, 6>(
        [&](const SE3::Tangent& e) {
          MountedSensor moved = mounted_sensor();
          moved.base_T_sensor = plus(e, moved.base_T_sensor);
          return linearise(s, map, moved, near)->residual;
        },
        SE3::Tangent::Zero().eval(), 1e-4);
    Eigen::Matrix<double, 8, 6> shown = mount;
    if (s.kind != ObservationKind::Corners) shown.middleCols<3>(2).setZero();
    EXPECT_LT((shown - z.H_mount).norm(), 1e-5 * (1 + z.H_mount.norm())) << static_cast<int>(s.kind);
  }
}

Riekf::Batch batch_of(const std::vector<Observation>& all, const Landmarks& map, const SE2& at) {
  Riekf::Batch batch{};
  for (std::size_t i = 0; i < all.size(); ++i) batch[i] = *linearise(all[i], map, mounted_sensor(), at);
  return batch;
}

/// Moving the whole scene rigidly in the plane does not change the gains.
TEST(Riekf, GainsDoNotDependOnTheOriginOfTheMap) {
  const SE2 moved(30, -20, 2);
  const SE2 X(0.1, -0.2, 0.15);
  const SE2 guess = SE2::exp({0.05, 0.02, -0.03}) * X;
  TagMap elsewhere = three_tags();
  for (auto& [id, tag] : elsewhere.tags) tag.map_T_tag = lift(moved) * tag.map_T_tag;
  const Landmarks here(three_tags());
  const Landmarks there(elsewhere);
  Eigen::Matrix3d P = Eigen::Vector3d(0.01, 0.02, 0.005).asDiagonal();
  const auto run = [&](const Landmarks& map, const SE2& at, const Eigen::Matrix3d& covariance) {
    Riekf filter(exact_map(), ErrorState::RightInvariant, zero(3));
    filter.start(at, covariance, false);
    const Riekf::Batch batch = batch_of(observations(X, here), map, at);
    filter.correct(batch, 3, filter.gain(batch, 3, Eigen::Vector3d::Zero()));
    return filter.state().map_T_base;
  };
  const Eigen::Matrix3d Ad = moved.adjoint();
  const SE2 corrected_here = run(here, guess, P);
  const SE2 corrected_there = run(there, moved * guess, Ad * P * Ad.transpose());
  EXPECT_LT(minus(moved * corrected_here, corrected_there).norm(), 1e-8);
  EXPECT_LT(minus(corrected_here, X).norm(), 0.2 * minus(guess, X).norm());
}

TEST(Riekf, TheOrderOfTagsInAFrameDoesNotMatter) {
  const Landmarks map(three_tags());
  const SE2 X(0.1, -0.2, 0.15);
  const SE2 guess = SE2::exp({0.05, 0.02, -0.03}) * X;
  std::vector<Observation> all = observations(X, map);
  std::vector<Matrix6> tag_covariance(3, Matrix6::Identity() * 1e-4);
  RiekfOptions options;
  const auto run = [&](const std::vector<Observation>& seen) {
    Riekf filter(options, ErrorState::RightInvariant, tag_covariance);
    filter.start(guess, Eigen::Matrix3d::Identity() * 0.01, false);
    const Riekf::Batch batch = batch_of(seen, map, guess);
    filter.correct(batch, 3, filter.gain(batch, 3, Eigen::Vector3d::Zero()));
    return filter.state();
  };
  const RiekfState forwards = run(all);
  std::swap(all[0], all[2]);
  const RiekfState backwards = run(all);
  EXPECT_LT(minus(forwards.map_T_base, backwards.map_T_base).norm(), 1e-12);
  EXPECT_LT((forwards.P - backwards.P).norm(), 1e-12);
}

/// Considered errors: a thousand observations of the same tag are not worth a thousand independent tags.
TEST(Riekf, ALastingErrorIsNotAveragedAway) {
  const Landmarks map(three_tags());
  const SE2 X(0.1, -0.2, 0.15);
  RiekfOptions options = exact_map();
  options.tag_time_s = 1e9;
  const double sigma = 0.01;
  Riekf filter(options, ErrorState::RightInvariant,
               std::vector<Matrix6>(3, Matrix6::Identity() * sigma * sigma));
  filter.start(X, Eigen::Matrix3d::Identity() * 0.01, false);
  const Riekf::Batch batch = batch_of({observations(X, map)[0]}, map, X);
  for (int i = 0; i < 1000; ++i) filter.correct(batch, 1, filter.gain(batch, 1, Eigen::Vector3d::Zero()));
  const double deviation = std::sqrt(filter.covariance().topLeftCorner<2, 2>().trace());
  EXPECT_GT(deviation, 0.9 * sigma);
  EXPECT_LT(deviation, 5 * sigma);
}

TEST(Riekf, BothFiltersAgreeForSmallErrors) {
  const Landmarks map(three_tags());
  const SE2 X(5, -3, 0.15);
  TagMap tags = three_tags();
  for (auto& [id, tag] : tags.tags) tag.map_T_tag = lift(SE2(4.9, -2.8, 0)) * tag.map_T_tag;
  const Landmarks moved(tags);
  const Observation seen = observations(SE2(0.1, -0.2, 0.15), map)[0];
  std::vector<Riekf> filters;
  for (const ErrorState error : {ErrorState::RightInvariant, ErrorState::Coordinates}) {
    Riekf filter(exact_map(), error, zero(3));
    const Uncertain<SE2> start =
        from_coordinate_covariance(X, Eigen::Matrix3d(Eigen::Matrix3d::Identity() * 1e-6));
    filter.start(SE2(X.x() + 1e-3, X.y() - 1e-3, X.yaw() + 1e-3), start.covariance, false);
    for (int i = 0; i < 10; ++i) {
      filter.propagate({.twist = {1e-3, 0, 1e-3}, .dt_s = 0.01});
      Riekf::Batch batch{};
      batch[0] = *linearise(seen, moved, mounted_sensor(), filter.state().map_T_base);
      filter.correct(batch, 1, filter.gain(batch, 1, Eigen::Vector3d::Zero()));
    }
    filters.push_back(filter);
  }
  EXPECT_LT(minus(filters[0].state().map_T_base, filters[1].state().map_T_base).norm(), 2e-5);
  EXPECT_LT((filters[0].covariance() - filters[1].covariance()).norm(),
            0.02 * filters[0].covariance().norm());
}

// Tests the propagation: time, divided messages and lasting errors.

MotionNoise noiseless() {
  return {.along_m_sqrt_m = 0,
          .across_m_sqrt_m = 0,
          .yaw_rad_sqrt_m = 0,
          .yaw_rad_sqrt_rad = 0,
          .yaw_rad_sqrt_s = 0,
          .drift_m_sqrt_s = 0,
          .slide_time_s = 0.05,
          .distance_scale_sigma = 0,
          .yaw_scale_sigma = 0,
          .yaw_bias_sigma_rad_s = 0,
          .slip_sigma_s = 0};
}

TEST(Riekf, IsSmoothAtAYawRateOfZero) {
  Riekf straight(exact_map(), ErrorState::RightInvariant, zero(0));
  Riekf almost(exact_map(), ErrorState::RightInvariant, zero(0));
  straight.start({}, Eigen::Matrix3d::Identity() * 1e-4, false);
  almost.start({}, Eigen::Matrix3d::Identity() * 1e-4, false);
  for (int i = 0; i < 100; ++i) {
    straight.propagate({.twist = {0.01, 0, 0}, .dt_s = 0.02});
    almost.propagate({.twist = {0.01, 0, 1e-14}, .dt_s = 0.02});
  }
  EXPECT_NEAR(straight.state().map_T_base.x(), 1.0, 1e-12);
  EXPECT_NEAR(straight.state().map_T_base.y(), 0, 1e-15);
  EXPECT_LT(minus(straight.state().map_T_base, almost.state().map_T_base).norm(), 1e-11);
}

MotionStep part_of(const MotionStep& step, double begin, double end) {
  const MotionSegment whole{SensorTime(Duration(0)), SensorTime(Duration(1000)), step};
  return whole.part(SensorTime(Duration(std::llround(1000 * begin))),
                    SensorTime(Duration(std::llround(1000 * end))));
}

/// The error of a message is a single twist, regardless of how many parts observations divide the message
/// into.
TEST(Riekf, DividingAMessageDoesNotChangeItsError) {
  RiekfOptions options = exact_map();
  options.motion.slide_m_s = 0.02;
  options.motion.crab_sigma_rad = 0.1;
  options.motion.crab_share = 1;
  options.motion.drift_m_sqrt_s = 0.01;
  const MotionStep step{.twist = {0.02, 0.001, 1e-4}, .dt_s = 0.05};
  Riekf whole(options, ErrorState::RightInvariant, zero(0));
  Riekf divided(options, ErrorState::RightInvariant, zero(0));
  for (Riekf* filter : {&whole, &divided})
    filter->start(SE2(0.3, -0.2, 0.4), Eigen::Matrix3d::Identity() * 1e-4, false);
  for (int i = 0; i < 20; ++i) {
    whole.propagate(step);
    divided.propagate(part_of(step, 0, 0.1));
    divided.propagate(part_of(step, 0.1, 0.7));
    divided.propagate(part_of(step, 0.7, 1));
  }
  EXPECT_LT(minus(whole.state().map_T_base, divided.state().map_T_base).norm(), 1e-6);
  EXPECT_LT((whole.state().P - divided.state().P).norm(), 1e-4 * whole.state().P.norm());
  // Within a message, the error grows in proportion to the part, not to its square root.
  Riekf middle(options, ErrorState::RightInvariant, zero(0));
  Riekf end(options, ErrorState::RightInvariant, zero(0));
  const MotionStep still{.twist = Eigen::Vector3d::Zero(), .dt_s = 0.05};
  middle.propagate(part_of(still, 0, 0.5));
  end.propagate(still);
  EXPECT_GT(end.state().P(2, 2), 10);
  EXPECT_NEAR(middle.state().P(2, 2) - 10, (end.state().P(2, 2) - 10) / 4, 1e-12);
}

/// Sliding is a Gauss-Markov velocity: over long times, the variance of its displacement is 2 sigma^2 tau t,
/// for steps of any length.
TEST(Riekf, SlidingHasTheVarianceOfAGaussMarkovProcess) {
  RiekfOptions options = exact_map();
  options.motion = noiseless();
  options.motion.slide_m_s = 0.1;
  const double tau = options.motion.slide_time_s;
  for (const int steps : {10, 100, 1000}) {
    Riekf filter(options, ErrorState::RightInvariant, zero(0));
    filter.start({}, Eigen::Matrix3d::Zero(), false);
    const double dt_s = 2.0 / steps;
    for (int i = 0; i < steps; ++i) filter.propagate({.twist = {0.1 * dt_s, 0, 0}, .dt_s = dt_s});
    const double expected = 2 * 0.01 * tau * (2 - tau * (1 - std::exp(-2 / tau)));
    EXPECT_NEAR(filter.state().P(1, 1), expected, 1e-9) << steps;
    EXPECT_LT(filter.state().P(0, 0), 1e-15);
  }
}

TEST(Riekf, TheErrorIsConstantWithoutNoise) {
  RiekfOptions options = exact_map();
  options.motion = noiseless();
  Riekf filter(options, ErrorState::RightInvariant, zero(0));
  const Eigen::Matrix3d P = (Eigen::Matrix3d() << 4, 1, 0.3, 1, 5, -0.2, 0.3, -0.2, 0.5).finished();
  const SE2 start(1, 2, 0.5);
  const SE2 truth = SE2::exp({0.4, -0.3, 0.7}) * start;
  filter.start(start, P, false);
  SE2 true_now = truth;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d u(0.05, 0.001, 0.02 * std::sin(0.1 * i));
    filter.propagate({.twist = u, .dt_s = 0.1});
    true_now = true_now * SE2::exp(u);
  }
  EXPECT_LT((filter.covariance() - P).norm(), 1e-12);
  const Eigen::Vector3d xi = minus(true_now, filter.state().map_T_base);
  EXPECT_LT((xi - Eigen::Vector3d(0.4, -0.3, 0.7)).norm(), 1e-10);
}

TEST(Riekf, NoiseDoesNotDependOnTheStepLength) {
  Riekf coarse(exact_map(), ErrorState::RightInvariant, zero(0));
  Riekf fine(exact_map(), ErrorState::RightInvariant, zero(0));
  coarse.start({}, Eigen::Matrix3d::Zero(), false);
  fine.start({}, Eigen::Matrix3d::Zero(), false);
  for (int i = 0; i < 100; ++i) coarse.propagate({.twist = {0.02, 0, 0.01}, .dt_s = 0.1});
  for (int i = 0; i < 1000; ++i) fine.propagate({.twist = {0.002, 0, 0.001}, .dt_s = 0.01});
  EXPECT_LT((coarse.covariance() - fine.covariance()).norm(), 0.01 * fine.covariance().norm());
}

}  // namespace
}  // namespace waymark
