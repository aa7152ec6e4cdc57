// What must hold for any bundle: the frame, the order of terms and the unit of length do not matter, more
// information never means less certainty, and numbers that are none do not pass as a result.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include "tests/support/random_pose.hpp"
#include "waymark/base/random.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using testing::random_pose;

constexpr double kSize = 0.2;
constexpr double kSigmaPx = 0.2;
constexpr std::size_t kTags = 6;
constexpr std::size_t kRigs = 10;

CameraModel lens() {
  PinholeRadtan radtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247, .coefficients = 4};
  radtan.k = {0.045, -0.077, 0.001, 0, 0, 0, 0, 0};
  return CameraModel::make(radtan, 640, 480).value();
}

/// A camera (poses 0 to 9) among tags of which the first is known; pose 16 is the map, 17 the camera's place.
Bundle wall(std::uint64_t seed) {
  Random random(seed);
  Bundle bundle;
  bundle.cameras = {lens()};
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
        corner += kSigmaPx * Eigen::Vector2d(random.normal(), random.normal());
      bundle.corners.push_back({rig, cam, map, tag, 0, corner_factor(detection, kSize, kSigmaPx).value()});
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

TEST(BundleLaws, TwiceAsLongIsTwiceAsFar) {
  Bundle bundle = wall(4);
  Bundle large = bundle;
  for (BundlePose& pose : large.poses) pose.value = SE3(pose.value.rotation(), 2 * pose.value.translation());
  for (CornerTerm& term : large.corners) term.factor.size_m *= 2;
  EXPECT_NEAR(cost(large), cost(bundle), 1e-9 * cost(bundle));
  ASSERT_TRUE(solve(bundle).usable() && solve(large).usable());
  for (PoseIndex i = 0; i < bundle.poses.size(); ++i)
    EXPECT_LT((large.poses[i].value.translation() - 2 * bundle.poses[i].value.translation()).norm(), 1e-6);
}

TEST(BundleLaws, TwiceTheNoiseIsFourTimesTheCovarianceAtTheSamePlace) {
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

TEST(BundleLaws, OneObservationMoreMakesNothingLessCertain) {
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

TEST(BundleLaws, WhatIsNotUsedHasNoSay) {
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

TEST(BundleLaws, TheMinimumIsOne) {
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

TEST(BundleLaws, NumbersThatAreNoneAreNoResult) {
  Bundle bundle = wall(10);
  bundle.corners[3].factor.corners_px[1].y() = std::nan("");
  EXPECT_FALSE(solve(bundle).usable());
  Bundle start = wall(11);
  start.poses[2].value = SE3({}, {std::nan(""), 0, 0});
  const BundleSummary summary = solve(start);
  EXPECT_TRUE(!summary.usable() || summary.invisible > 0);
}

TEST(BundleLaws, ATagBehindTheCameraIsSetAside) {
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

/// The camera unknown, near what is given.
Bundle with_free_camera(Bundle bundle, const Eigen::VectorXd& given) {
  bundle.cameras = {with_intrinsics(bundle.cameras[0], given).value()};
  BundleIntrinsics free{.prior = given};
  free.sigma = 0.02 * given.cwiseAbs() + Eigen::VectorXd::Constant(given.size(), 0.05);
  bundle.intrinsics = {free};
  return bundle;
}

TEST(BundleLaws, AFreeCameraCostsNoMoreAndItsPosesAreNoMoreCertain) {
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

TEST(BundleLaws, AFreeCameraIsFoundFromWhatIsGivenWrong) {
  const Bundle truth = wall(14);
  Eigen::VectorXd given = intrinsics_of(truth.cameras[0]);
  given.head<4>() += Eigen::Vector4d(4, 4, -3, 2);
  Bundle free = with_free_camera(truth, given);
  Bundle near = with_free_camera(truth, intrinsics_of(truth.cameras[0]));
  near.intrinsics = free.intrinsics;  // the same prior, another start
  const BundleOptions to_the_end{.relative_gain = 1e-14};
  ASSERT_TRUE(solve(free, to_the_end).usable() && solve(near, to_the_end).usable());
  EXPECT_NEAR(cost(free), cost(near), 1e-6 * cost(near)) << "one minimum from both sides";
  const Eigen::VectorXd off = intrinsics_of(free.cameras[0]) - intrinsics_of(near.cameras[0]);
  EXPECT_LT(off.cwiseQuotient(free.intrinsics[0].sigma).cwiseAbs().maxCoeff(), 0.01);
}

TEST(BundleLaws, ACameraThatCannotBeIsNotTaken) {
  Bundle bundle = wall(15);
  Eigen::VectorXd given = intrinsics_of(bundle.cameras[0]);
  Bundle free = with_free_camera(bundle, given);
  free.intrinsics[0].prior[0] = -500;  // pulls to where no camera is
  free.intrinsics[0].sigma[0] = 0.001;
  const BundleSummary summary = solve(free, {.max_iterations = 30});
  EXPECT_LE(summary.final_cost, summary.initial_cost);
  EXPECT_GT(intrinsics_of(free.cameras[0])[0], 0);
  EXPECT_TRUE(free.intrinsics[0].possible);
}

}  // namespace
}  // namespace waymark
