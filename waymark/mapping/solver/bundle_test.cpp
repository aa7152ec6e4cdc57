// Bundle adjustment compared with ground truth, with the dense inverse, and over many draws of the noise;
// then the invariants of every bundle.
#include "waymark/mapping/solver/bundle.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "tests/support/random_pose.hpp"
#include "waymark/base/random.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/solver/block_system.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using testing::random_pose;

CameraModel lens() {
  PinholeRadtan radtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247, .coefficients = 4};
  radtan.k = {0.045, -0.077, 0, 0, 0, 0, 0, 0};
  return CameraModel::make(radtan, 640, 480).value();
}

/// A rig of two cameras that moves along a wall of tags. The mounting of the second camera is unknown. A body
/// with two tags is visible in both cameras. All measurements are noise-free, and the poses are the ground
/// truth.
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

/// Gives each tag a size of its own that deviates from the given one. Its square in the images is unchanged.
void print_badly(Bundle& bundle, Random& random, double sigma) {
  std::map<PoseIndex, std::size_t> sizes;
  std::vector<double> log_scales;
  for (CornerTerm& term : bundle.corners) {
    const auto [size, is_new] = sizes.try_emplace(term.tag, sizes.size());
    if (is_new) log_scales.push_back(sigma * random.normal());
    term.size = size->second;
    term.factor.size_m = kSize / std::exp(log_scales[size->second]);
  }
  bundle.sizes.assign(sizes.size(), {.sigma = sigma});
  for (std::size_t i = 0; i < log_scales.size(); ++i) bundle.sizes[i].log_scale = log_scales[i];
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

TEST(Bundle, FindsSizes) {
  for (const bool free_camera : {false, true}) {
    Scene scene = make_scene(1);
    Random random(2);
    print_badly(scene.bundle, random, 0.05);
    std::vector<double> truth;
    for (BundleSize& size : scene.bundle.sizes) {
      truth.push_back(std::exchange(size.log_scale, 0));
      size.sigma = 1e3;  // nearly no prior
    }
    if (free_camera) {
      const Eigen::VectorXd now = intrinsics_of(scene.bundle.cameras[0]);
      scene.bundle.intrinsics = {{now, 1e-3 * now.cwiseAbs().cwiseMax(1)}};
    }
    disturb(scene.bundle, random, 0.05, 0.05);
    EXPECT_TRUE(solve(scene.bundle).converged);
    // Only the fixed tag determines the scale of the map, so its size cannot be wrong.
    const double scale = scene.bundle.sizes[0].log_scale - truth[0];
    for (std::size_t i = 0; i < truth.size(); ++i)
      EXPECT_NEAR(scene.bundle.sizes[i].log_scale - truth[i], scale, 1e-6) << i;
  }
}

TEST(Bundle, AnExactSizeIsNoUnknown) {
  Scene scene = make_scene(1);
  Random random(2);
  print_badly(scene.bundle, random, 0.05);
  for (BundleSize& size : scene.bundle.sizes) size.sigma = 0;
  const internal::Unknowns unknowns = internal::unknowns_of(scene.bundle);
  EXPECT_EQ(std::ranges::count(unknowns.dimensions, 1), 0);
  EXPECT_LT(cost(scene.bundle), 1e-12);  // a value other than zero is still used
  for (const double variance : covariance(scene.bundle).sizes) EXPECT_EQ(variance, 0);
}

TEST(Bundle, CovarianceOfSizesIsConsistent) {
  constexpr int kDraws = 400;
  constexpr double kSigma = 0.01;
  Random random(8);
  double sum = 0;
  int count = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Scene scene = make_scene(6);
    print_badly(scene.bundle, random, kSigma);
    std::vector<double> truth;
    for (BundleSize& size : scene.bundle.sizes) truth.push_back(std::exchange(size.log_scale, 0));
    add_noise(scene.bundle, random);
    ASSERT_TRUE(solve(scene.bundle).usable());
    const BundleCovariance P = covariance(scene.bundle);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      EXPECT_LE(P.sizes[i], kSigma * kSigma);
      sum += std::pow(scene.bundle.sizes[i].log_scale - truth[i], 2) / P.sizes[i];
      ++count;
    }
  }
  // The sizes of a draw share the error of the only fixed tag, but draws are independent.
  EXPECT_NEAR(sum / count, 1, 3 * std::sqrt(2.0 / kDraws));
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
  Scene scene = make_scene(5);
  Random random(6);
  print_badly(scene.bundle, random, 0.02);
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
  for (std::size_t i = 0; i < P.sizes.size(); ++i) {
    const int at = system.offset(unknowns.of_sizes[i]);
    EXPECT_NEAR(P.sizes[i], dense(at, at), 1e-6 * dense(at, at)) << i;
  }
}

TEST(Bundle, CovarianceIsConsistent) {
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
  // Poses within a draw are correlated, but draws are independent. The mean over 40 draws of chi-square with
  // 6 degrees of freedom is 6 +- 0.55, even if all poses of a draw have the same error.
  EXPECT_NEAR(nees / poses, 6, 3 * std::sqrt(2 * 6.0 / kDraws));
  const auto unknowns = internal::unknowns_of(scene.bundle);
  const double redundancy = 8.0 * static_cast<double>(scene.bundle.corners.size()) -
                            6.0 * static_cast<double>(unknowns.dimensions.size());
  EXPECT_NEAR(cost_sum / kDraws, redundancy, 4 * std::sqrt(2 * redundancy / kDraws));
}

TEST(Bundle, ReportsUndeterminedPoses) {
  Scene scene = make_scene(8);
  // A pose for which only the height is measured.
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

TEST(Bundle, TurnNoiseDoesNotBiasScalesTowardsZero) {
  // The drive is mostly straight with an occasional turn, so most of the measured turning is noise.
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
    const SE2::Tangent measured = SE2::Tangent(way, 0, turn / kYaw) + sigma.cwiseProduct(noise);
    bundle.odometry.push_back(
        {before, here, 0, {SE2::exp(measured), sigma.cwiseInverse().asDiagonal(), kDt_s}});
    before = here;
  }
  ASSERT_TRUE(solve(bundle).usable());
  const OdometryScales& found = bundle.odometry_scales[0].value;
  const auto spread = OdometryScales::of(covariance(bundle).scales[0].diagonal().cwiseSqrt());
  EXPECT_NEAR(found.yaw, kYaw, 3 * spread.yaw);
  EXPECT_NEAR(found.lateral_slip_s, kSlip_s, 3 * spread.lateral_slip_s);
  EXPECT_LT(spread.yaw, 0.02);
  EXPECT_LT(spread.lateral_slip_s, 0.005);
}

TEST(Bundle, AnEmptyOrStoppedSearchIsNotUsable) {
  Bundle empty;
  EXPECT_FALSE(solve(empty).usable());
  Scene scene = make_scene(10);
  const BundleSummary stopped = solve(scene.bundle, {}, [](int, double) { return false; });
  EXPECT_EQ(stopped.iterations, 0) << "Ctrl-C ends the search before the first step";
  EXPECT_TRUE(stopped.stopped);
  EXPECT_FALSE(stopped.usable());
}

TEST(Bundle, ACovarianceThatCannotBeComputedIsNotZero) {
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

// Invariants of every bundle. The frame, the order of terms and the unit of length do not matter; more
// information never increases the covariance; non-finite input never yields a usable result.

constexpr double kWallSigmaPx = 0.2;
constexpr std::size_t kTags = 6;
constexpr std::size_t kRigs = 10;

CameraModel wall_lens() {
  PinholeRadtan radtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247, .coefficients = 4};
  radtan.k = {0.045, -0.077, 0.001, 0, 0, 0, 0, 0};
  return CameraModel::make(radtan, 640, 480).value();
}

/// A camera (poses 0 to 9) among tags, the first of which is fixed. Pose 16 is the map, and 17 is the camera
/// mounting.
Bundle wall(std::uint64_t seed) {
  Random random(seed);
  Bundle bundle;
  bundle.cameras = {wall_lens()};
  for (std::size_t k = 0; k < kRigs; ++k) {
    const double s = static_cast<double>(k);
    bundle.add(SE3({}, {0.15 * s - 0.7, 0.1 * std::sin(s), 0.05 * s}) * random_pose(random, 0.1, 0.2));
  }
  for (std::size_t i = 0; i < kTags; ++i) {
    const double s = static_cast<double>(i);
    bundle.add(SE3({}, {0.4 * s - 1, 0.25 * std::sin(2 * s), 2}) * random_pose(random, 0.1, 0.3), i == 0);
  }
  const PoseIndex map = bundle.add({}, true);
  const PoseIndex cam = bundle.add({}, true);
  for (PoseIndex rig = 0; rig < kRigs; ++rig) {
    for (PoseIndex tag = kRigs; tag < kRigs + kTags; ++tag) {
      const SE3 cam_T_tag = bundle.poses[rig].value.inverse() * bundle.poses[tag].value;
      const auto corners = visible_corners(bundle.cameras[0], cam_T_tag, kSize);
      if (!corners) continue;
      TagDetection detection{.corners_px = *corners};
      for (auto& corner : detection.corners_px)
        corner += kWallSigmaPx * Eigen::Vector2d(random.normal(), random.normal());
      bundle.corners.push_back(
          {rig, cam, map, tag, 0, corner_factor(detection, kSize, kWallSigmaPx).value()});
    }
  }
  return bundle;
}

TEST(BundleLaws, TheFrameOfTheMapDoesNotMatter) {
  Random random(1);
  for (int round = 0; round < 5; ++round) {
    Bundle here = wall(2);
    Bundle there = here;
    const SE3 by = random_pose(random, 20, 3);
    for (PoseIndex i = 0; i < kRigs + kTags; ++i) there.poses[i].value = by * there.poses[i].value;
    EXPECT_NEAR(cost(there), cost(here), 1e-6 * cost(here));
    ASSERT_TRUE(solve(here).usable() && solve(there).usable());
    for (PoseIndex i = 0; i < kRigs + kTags; ++i)
      EXPECT_LT(minus(there.poses[i].value, by * here.poses[i].value).norm(), 1e-6) << i;
    const BundleCovariance P = covariance(here);
    const BundleCovariance Q = covariance(there);
    const Matrix6 Ad = by.adjoint();
    for (PoseIndex i = 0; i < kRigs + kTags; ++i) {
      const Matrix6 expected = Ad * P.poses[i] * Ad.transpose();
      EXPECT_LT((Q.poses[i] - expected).norm(), 1e-4 * (1e-12 + expected.norm())) << i;
    }
  }
}

TEST(BundleLaws, TheOrderOfTermsAndPosesDoesNotMatter) {
  Bundle bundle = wall(3);
  Bundle mixed = bundle;
  std::ranges::reverse(mixed.corners);
  const auto mirrored = [&](PoseIndex i) { return bundle.poses.size() - 1 - i; };
  std::ranges::reverse(mixed.poses);
  for (CornerTerm& term : mixed.corners) {
    term.rig = mirrored(term.rig);
    term.cam = mirrored(term.cam);
    term.body = mirrored(term.body);
    term.tag = mirrored(term.tag);
  }
  ASSERT_TRUE(solve(bundle).usable() && solve(mixed).usable());
  EXPECT_NEAR(cost(mixed), cost(bundle), 1e-9 * cost(bundle));
  const BundleCovariance P = covariance(bundle);
  const BundleCovariance Q = covariance(mixed);
  for (PoseIndex i = 0; i < bundle.poses.size(); ++i) {
    EXPECT_LT(minus(mixed.poses[mirrored(i)].value, bundle.poses[i].value).norm(), 1e-6) << i;
    EXPECT_LT((Q.poses[mirrored(i)] - P.poses[i]).norm(), 1e-5 * (1e-12 + P.poses[i].norm())) << i;
  }
}

TEST(BundleLaws, ScalesWithTheUnitOfLength) {
  Bundle bundle = wall(4);
  Bundle large = bundle;
  for (BundlePose& pose : large.poses) pose.value = SE3(pose.value.rotation(), 2 * pose.value.translation());
  for (CornerTerm& term : large.corners) term.factor.size_m *= 2;
  EXPECT_NEAR(cost(large), cost(bundle), 1e-9 * cost(bundle));
  ASSERT_TRUE(solve(bundle).usable() && solve(large).usable());
  for (PoseIndex i = 0; i < bundle.poses.size(); ++i)
    EXPECT_LT((large.poses[i].value.translation() - 2 * bundle.poses[i].value.translation()).norm(), 1e-6);
}

TEST(BundleLaws, TwiceTheNoiseIsFourTimesTheCovariance) {
  Bundle bundle = wall(5);
  Bundle rough = bundle;
  for (CornerTerm& term : rough.corners) term.factor.whitening /= 2;
  ASSERT_TRUE(solve(bundle).usable() && solve(rough).usable());
  EXPECT_NEAR(cost(rough), cost(bundle) / 4, 1e-6 * cost(bundle));
  const BundleCovariance P = covariance(bundle);
  const BundleCovariance Q = covariance(rough);
  for (PoseIndex i = 0; i < kRigs + kTags; ++i) {
    EXPECT_LT(minus(rough.poses[i].value, bundle.poses[i].value).norm(), 1e-5) << i;
    EXPECT_LT((Q.poses[i] - 4 * P.poses[i]).norm(), 1e-3 * (1e-12 + Q.poses[i].norm())) << i;
  }
}

TEST(BundleLaws, OneMoreObservationIncreasesNoCovariance) {
  Bundle all = wall(6);
  ASSERT_TRUE(solve(all).usable());
  Bundle fewer = all;
  for (std::size_t i = 0; i < fewer.corners.size(); i += 3) fewer.corners[i].used = false;
  const BundleCovariance P = covariance(all);
  const BundleCovariance Q = covariance(fewer);
  for (PoseIndex i = 0; i < kRigs + kTags; ++i) {
    const Eigen::SelfAdjointEigenSolver<Matrix6> gain(Q.poses[i] - P.poses[i]);
    EXPECT_GE(gain.eigenvalues().minCoeff(), -1e-9 * Q.poses[i].norm()) << i;
  }
}

TEST(BundleLaws, UnusedTermsHaveNoEffect) {
  Bundle bundle = wall(7);
  Bundle more = bundle;
  for (std::size_t i = 0; i < bundle.corners.size(); i += 5) {
    CornerTerm wrong = bundle.corners[i];
    wrong.used = false;
    for (auto& corner : wrong.factor.corners_px) corner.x() += 50;
    more.corners.push_back(wrong);
  }
  ASSERT_TRUE(solve(bundle).usable() && solve(more).usable());
  for (PoseIndex i = 0; i < bundle.poses.size(); ++i)
    EXPECT_EQ(more.poses[i].value.translation(), bundle.poses[i].value.translation()) << i;
}

TEST(BundleLaws, NoNearbyPoseHasALowerCost) {
  Bundle bundle = wall(8);
  ASSERT_TRUE(solve(bundle).usable());
  const double least = cost(bundle);
  Random random(9);
  for (int round = 0; round < 50; ++round) {
    Bundle moved = bundle;
    const PoseIndex i = random.index(kRigs + kTags);
    if (moved.poses[i].fixed) continue;
    moved.poses[i].value = random_pose(random, 1e-3, 1e-3) * moved.poses[i].value;
    EXPECT_GT(cost(moved), least);
  }
}

TEST(BundleLaws, NonFiniteInputIsNotUsable) {
  Bundle bundle = wall(10);
  bundle.corners[3].factor.corners_px[1].y() = std::nan("");
  EXPECT_FALSE(solve(bundle).usable());
  Bundle start = wall(11);
  start.poses[2].value = SE3({}, {std::nan(""), 0, 0});
  const BundleSummary summary = solve(start);
  EXPECT_TRUE(!summary.usable() || summary.invisible > 0);
}

TEST(BundleLaws, ATagBehindTheCameraIsExcluded) {
  Bundle bundle = wall(12);
  const PoseIndex behind = bundle.add(SE3({}, {0, 0, -2}));
  CornerTerm term = bundle.corners.front();
  term.tag = behind;
  bundle.corners.push_back(term);
  const BundleSummary summary = solve(bundle);
  EXPECT_TRUE(summary.usable());
  EXPECT_EQ(summary.invisible, 1);
  EXPECT_FALSE(bundle.corners.back().used);
  EXPECT_TRUE(std::isinf(corner_chi2(bundle).back()));
}

/// The bundle with an unknown camera whose prior mean is `given`.
Bundle with_free_camera(Bundle bundle, const Eigen::VectorXd& given) {
  bundle.cameras = {with_intrinsics(bundle.cameras[0], given).value()};
  BundleIntrinsics free{.prior = given};
  free.sigma = 0.02 * given.cwiseAbs() + Eigen::VectorXd::Constant(given.size(), 0.05);
  bundle.intrinsics = {free};
  return bundle;
}

TEST(BundleLaws, AFreeCameraLowersTheCostAndRaisesTheCovariance) {
  Bundle held = wall(13);
  Bundle free = with_free_camera(held, intrinsics_of(held.cameras[0]));
  ASSERT_TRUE(solve(held).usable() && solve(free).usable());
  EXPECT_LT(cost(free), cost(held));
  const BundleCovariance P = covariance(held);
  const BundleCovariance Q = covariance(free);
  ASSERT_EQ(Q.intrinsics.size(), 1U);
  EXPECT_EQ(P.intrinsics[0].size(), 0);
  EXPECT_GT(Q.intrinsics[0].diagonal().minCoeff(), 0);
  for (PoseIndex i = 0; i < kRigs + kTags; ++i)
    EXPECT_GE(Q.poses[i].trace(), 0.999 * P.poses[i].trace()) << i;
}

TEST(BundleLaws, AFreeCameraConvergesFromAWrongStart) {
  const Bundle truth = wall(14);
  Eigen::VectorXd given = intrinsics_of(truth.cameras[0]);
  given.head<4>() += Eigen::Vector4d(4, 4, -3, 2);
  Bundle free = with_free_camera(truth, given);
  Bundle near = with_free_camera(truth, intrinsics_of(truth.cameras[0]));
  near.intrinsics = free.intrinsics;  // the same prior, but another starting value
  const BundleOptions to_the_end{.relative_gain = 1e-14};
  ASSERT_TRUE(solve(free, to_the_end).usable() && solve(near, to_the_end).usable());
  EXPECT_NEAR(cost(free), cost(near), 1e-6 * cost(near)) << "both starting values lead to the same minimum";
  const Eigen::VectorXd off = intrinsics_of(free.cameras[0]) - intrinsics_of(near.cameras[0]);
  EXPECT_LT(off.cwiseQuotient(free.intrinsics[0].sigma).cwiseAbs().maxCoeff(), 0.01);
}

TEST(BundleLaws, InvalidCameraParametersAreRejected) {
  Bundle bundle = wall(15);
  Eigen::VectorXd given = intrinsics_of(bundle.cameras[0]);
  Bundle free = with_free_camera(bundle, given);
  free.intrinsics[0].prior[0] = -500;  // pulls the estimate towards an invalid focal length
  free.intrinsics[0].sigma[0] = 0.001;
  const BundleSummary summary = solve(free, {.max_iterations = 30});
  EXPECT_LE(summary.final_cost, summary.initial_cost);
  EXPECT_GT(intrinsics_of(free.cameras[0])[0], 0);
  EXPECT_TRUE(free.intrinsics[0].possible);
}

TEST(Bundle, ARelativeTermCanBeRobustOrUnused) {
  const auto solved_x = [](bool robust, bool used) {
    Bundle bundle;
    const PoseIndex a = bundle.add({}, true);
    const PoseIndex b = bundle.add(SE3({}, Eigen::Vector3d(1, 0, 0)));
    for (const double x : {1.0, 1.0, 1.0, 9.0}) {
      const bool wrong = x > 1;
      bundle.relatives.push_back(
          {.a = a,
           .b = b,
           .factor = {SE3({}, Eigen::Vector3d(x, 0, 0)), {}, 100 * Matrix6::Identity()},
           .robust = robust,
           .used = used || !wrong});
    }
    EXPECT_TRUE(solve(bundle, {.robust_chi2 = 12}).usable());
    return bundle.poses[b].value.translation().x();
  };
  EXPECT_NEAR(solved_x(false, true), 3, 1e-6) << "the mean";
  EXPECT_NEAR(solved_x(true, true), 1, 0.001);
  EXPECT_NEAR(solved_x(true, false), 1, 1e-9);
}

}  // namespace
}  // namespace waymark
