// Bundle adjustment against the truth, against the dense inverse, and over many draws of its own noise.
#include "waymark/mapping/solver/bundle.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/random_pose.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/solver/bundle_terms.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using testing::random_pose;

CameraModel lens() {
  PinholeRadtan radtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247, .coefficients = 4};
  radtan.k = {0.045, -0.077, 0, 0, 0, 0, 0, 0};
  return CameraModel::make(radtan, 640, 480).value();
}

/// A rig of two cameras that walks past a wall of tags, the second camera's place on it unknown, and a body
/// with two tags that both cameras see. Everything noise-free; poses are the truth.
struct Scene {
  Bundle bundle{};
  std::vector<SE3> truth{};
};

constexpr double kSize = 0.2;
constexpr double kSigmaPx = 0.1;

void see(Bundle& bundle, PoseIndex rig, PoseIndex cam, PoseIndex body, PoseIndex tag) {
  const auto& poses = bundle.poses;
  const SE3 cam_T_tag =
      (poses[rig].value * poses[cam].value).inverse() * poses[body].value * poses[tag].value;
  const auto corners = visible_corners(bundle.cameras[0], cam_T_tag, kSize);
  if (!corners) return;
  TagDetection detection;
  detection.corners_px = *corners;
  bundle.corners.push_back({rig, cam, body, tag, 0, corner_factor(detection, kSize, kSigmaPx).value()});
}

Scene make_scene(std::uint64_t seed) {
  Random random(seed);
  Scene scene;
  Bundle& bundle = scene.bundle;
  bundle.cameras = {lens()};
  const PoseIndex map = bundle.add({}, true);
  const PoseIndex left = bundle.add({}, true);
  const PoseIndex right = bundle.add(SE3(SO3::exp({0, 0.2, 0}), Eigen::Vector3d(0.3, 0, 0)));
  std::vector<PoseIndex> tags;
  for (int i = 0; i < 10; ++i) {
    const SE3 on_wall(SO3::exp({0, 0, 0}), Eigen::Vector3d(0.4 * i - 1.5, 0.3 * (i % 3) - 0.3, 2));
    tags.push_back(bundle.add(on_wall * random_pose(random, 0.1, 0.3), i == 0));
  }
  std::vector<PoseIndex> body_tags = {bundle.add({}, true),
                                      bundle.add(SE3({}, Eigen::Vector3d(0.3, 0.05, 0)))};
  for (int k = 0; k < 12; ++k) {
    const PoseIndex rig = bundle.add(SE3({}, Eigen::Vector3d(0.25 * k - 1.5, 0, 0.2 * (k % 3))) *
                                     random_pose(random, 0.05, 0.1));
    const PoseIndex body =
        bundle.add(SE3({}, Eigen::Vector3d(0.25 * k - 1.4, 0.1, 1.4)) * random_pose(random, 0.1, 0.2));
    for (PoseIndex cam : {left, right}) {
      for (PoseIndex tag : tags) see(bundle, rig, cam, map, tag);
      for (PoseIndex tag : body_tags) see(bundle, rig, cam, body, tag);
    }
  }
  for (const BundlePose& pose : bundle.poses) scene.truth.push_back(pose.value);
  return scene;
}

void disturb(Bundle& bundle, Random& random, double metres, double radians) {
  for (BundlePose& pose : bundle.poses) {
    if (!pose.fixed) pose.value = random_pose(random, metres, radians) * pose.value;
  }
}

void add_noise(Bundle& bundle, Random& random) {
  for (CornerTerm& term : bundle.corners) {
    for (auto& corner : term.factor.corners_px)
      corner += kSigmaPx * Eigen::Vector2d(random.normal(), random.normal());
  }
}

TEST(Bundle, FindsTheTruthWithoutNoise) {
  Scene scene = make_scene(1);
  Random random(2);
  disturb(scene.bundle, random, 0.05, 0.05);
  const BundleSummary summary = solve(scene.bundle);
  EXPECT_TRUE(summary.converged);
  EXPECT_LT(summary.final_cost, 1e-12);
  for (std::size_t i = 0; i < scene.truth.size(); ++i)
    EXPECT_LT(minus(scene.bundle.poses[i].value, scene.truth[i]).norm(), 1e-7) << i;
}

TEST(Bundle, ARobustLossIgnoresWhatIsWrong) {
  Scene scene = make_scene(3);
  for (std::size_t i = 5; i < scene.bundle.corners.size(); i += 20) {
    for (auto& corner : scene.bundle.corners[i].factor.corners_px) corner.x() += 30;
  }
  Random random(4);
  disturb(scene.bundle, random, 0.02, 0.02);
  EXPECT_TRUE(solve(scene.bundle, {.robust_chi2 = 20}).usable());
  for (std::size_t i = 0; i < scene.truth.size(); ++i)
    EXPECT_LT(minus(scene.bundle.poses[i].value, scene.truth[i]).norm(), 0.01) << i;
  const std::vector<double> chi2 = corner_chi2(scene.bundle);
  for (std::size_t i = 0; i < chi2.size(); ++i) EXPECT_EQ(chi2[i] > 1e4, i % 20 == 5) << i;
}

TEST(Bundle, CovarianceIsTheDenseInverse) {
  const Scene scene = make_scene(5);
  const auto unknowns = internal::unknowns_of(scene.bundle);
  internal::BlockSystem system(unknowns.dimensions, unknowns.couplings);
  internal::accumulate(scene.bundle, unknowns, 0, &system);
  const Eigen::MatrixXd lower = system.lower();
  const Eigen::MatrixXd H = lower.selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd dense = H.llt().solve(Eigen::MatrixXd::Identity(H.rows(), H.cols()));
  const BundleCovariance P = covariance(scene.bundle);
  EXPECT_TRUE(P.undetermined.empty());
  for (std::size_t i = 0; i < P.poses.size(); ++i) {
    if (unknowns.of_pose[i] < 0) continue;
    const int at = system.offset(unknowns.of_pose[i]);
    const Matrix6 expected = dense.block<6, 6>(at, at);
    EXPECT_LT((P.poses[i] - expected).norm(), 1e-6 * expected.norm()) << i;
  }
}

TEST(Bundle, IsAsCertainAsItSays) {
  const Scene scene = make_scene(6);
  const BundleCovariance P = covariance(scene.bundle);
  Random random(7);
  double nees = 0;
  int poses = 0;
  double cost_sum = 0;
  constexpr int kDraws = 40;
  for (int draw = 0; draw < kDraws; ++draw) {
    Bundle bundle = scene.bundle;
    add_noise(bundle, random);
    const BundleSummary summary = solve(bundle);
    ASSERT_TRUE(summary.usable());
    cost_sum += 2 * summary.final_cost;
    for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
      if (bundle.poses[i].fixed) continue;
      const Vector6 e = minus(bundle.poses[i].value, scene.truth[i]);
      nees += e.dot(P.poses[i].llt().solve(e));
      ++poses;
    }
  }
  // Poses of one draw hang together; between draws they are independent: 40 draws of chi-square with 6
  // degrees of freedom have a mean of 6 +- 0.55 even if all poses of a draw erred as one.
  EXPECT_NEAR(nees / poses, 6, 3 * std::sqrt(2 * 6.0 / kDraws));
  const auto unknowns = internal::unknowns_of(scene.bundle);
  const double freedom = 8.0 * static_cast<double>(scene.bundle.corners.size()) -
                         6.0 * static_cast<double>(unknowns.dimensions.size());
  EXPECT_NEAR(cost_sum / kDraws, freedom, 4 * std::sqrt(2 * freedom / kDraws));
}

TEST(Bundle, SaysWhatNothingDetermines) {
  Scene scene = make_scene(8);
  // A pose that only has a known height.
  const PoseIndex loose = scene.bundle.add({});
  scene.bundle.coordinates.push_back({loose, {Eigen::Vector3d::UnitZ(), 1.0, 0.01}});
  EXPECT_TRUE(solve(scene.bundle).usable());
  EXPECT_NEAR(scene.bundle.poses[loose].value.translation().z(), 1, 1e-6);
  const BundleCovariance P = covariance(scene.bundle);
  ASSERT_EQ(P.undetermined.size(), 1U);
  EXPECT_EQ(P.undetermined[0], loose);
}

TEST(Bundle, OdometryScalesAreFound) {
  Bundle bundle;
  bundle.odometry_scales.push_back({});
  Random random(9);
  SE2 at;
  PoseIndex before = bundle.add({}, true);
  for (int k = 0; k < 30; ++k) {
    const SE2 motion = SE2::exp({0.1, 0, 0.2 * std::sin(0.3 * k)});
    at = at * motion;
    const PoseIndex here =
        bundle.add(SE3(SO3::exp({0, 0, at.yaw()}), Eigen::Vector3d(at.x(), at.y(), 0)), true);
    const SE2::Tangent twist = motion.log();
    bundle.odometry.push_back(
        {before,
         here,
         0,
         {SE2::exp({twist[0] / 1.05, twist[1] / 1.05, twist[2] / 0.8}), 100 * Eigen::Matrix3d::Identity()}});
    before = here;
  }
  bundle.odometry_scales[0].sigma = {10, 10};
  EXPECT_TRUE(solve(bundle).usable());
  EXPECT_NEAR(bundle.odometry_scales[0].value.distance, 1.05, 1e-4);
  EXPECT_NEAR(bundle.odometry_scales[0].value.yaw, 0.8, 1e-4);
  EXPECT_GT(covariance(bundle).scales[0](0, 0), 0);
}

TEST(Bundle, NoiseOfTheTurnsDrawsNoScaleTowardsZero) {
  // Straight on, now and then a bend: most of what the wheels tell of turning is noise.
  constexpr double kYaw = 0.9;
  constexpr double kSlip_s = 0.08;
  constexpr double kDt_s = 0.1;
  const Eigen::Vector3d sigma(5e-4, 5e-4, 0.01);
  Bundle bundle;
  bundle.odometry_scales.push_back({.sigma = {1, 1, 1, 1, 1, 1}});
  Random random(10);
  SE2 at;
  PoseIndex before = bundle.add({}, true);
  for (int k = 0; k < 4000; ++k) {
    const double speed_m_s = k % 20 < 10 ? 0.3 : 0.6;
    const double turn = k % 100 < 20 ? 0.03 : 0;
    const double way = speed_m_s * kDt_s;
    at = at * SE2::exp({way, kSlip_s * way * turn / kDt_s, turn});
    const PoseIndex here =
        bundle.add(SE3(SO3::exp({0, 0, at.yaw()}), Eigen::Vector3d(at.x(), at.y(), 0)), true);
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    const SE2::Tangent told = SE2::Tangent(way, 0, turn / kYaw) + sigma.cwiseProduct(noise);
    bundle.odometry.push_back({before, here, 0, {SE2::exp(told), sigma.cwiseInverse().asDiagonal(), kDt_s}});
    before = here;
  }
  ASSERT_TRUE(solve(bundle).usable());
  const OdometryScales& found = bundle.odometry_scales[0].value;
  const auto spread = OdometryScales::of(covariance(bundle).scales[0].diagonal().cwiseSqrt());
  EXPECT_NEAR(found.yaw, kYaw, 3 * spread.yaw);
  EXPECT_NEAR(found.slip_s, kSlip_s, 3 * spread.slip_s);
  EXPECT_LT(spread.yaw, 0.02);
  EXPECT_LT(spread.slip_s, 0.005);
}

TEST(Bundle, NothingToDoIsSaid) {
  Bundle empty;
  EXPECT_FALSE(solve(empty).usable());
  Scene scene = make_scene(10);
  const BundleSummary stopped = solve(scene.bundle, {}, [](int, double) { return false; });
  EXPECT_EQ(stopped.iterations, 0) << "Ctrl-C ends it where it is";
  EXPECT_TRUE(stopped.stopped);
  EXPECT_FALSE(stopped.usable());
}

TEST(Bundle, ACovarianceThatCannotBeFoundIsNotZero) {
  Bundle bundle;
  const PoseIndex first = bundle.add({});
  Matrix6 whitening = 1e12 * Matrix6::Identity();
  for (int i = 0; i < 20; ++i) {
    const SE3 step(SO3::exp({0.1, 0.2, 0.3}), Eigen::Vector3d(1000, 10, 1));
    const PoseIndex next = bundle.add(bundle.poses.back().value * step);
    bundle.relatives.push_back({next - 1, next, {step, {}, whitening}});
  }
  const BundleCovariance P = covariance(bundle);
  EXPECT_FALSE(P.undetermined.empty());
  for (PoseIndex i : P.undetermined) EXPECT_GT(P.poses[i].diagonal().maxCoeff(), 1e3) << i;
  EXPECT_GT(P.poses[first].diagonal().minCoeff(), 0);
}

}  // namespace
}  // namespace waymark
