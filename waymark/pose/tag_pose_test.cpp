#include "waymark/pose/tag_pose.hpp"

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <opencv2/calib3d.hpp>

#include "tests/support/geometry_matchers.hpp"
#include "tests/support/golden_page.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/tag_views.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/pose/square_pose.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::kTagSize;
using testing::MatrixNear;
using testing::SE3Near;
using testing::see_tag;
using testing::some_covariance;
using testing::with_noise;
using Vector6 = SE3::Tangent;

/// Sum of squared pixel errors divided by their variances, implemented independently. This is the cost that
/// both solutions minimise.
double cost(const CameraModel& camera, const TagDetection& seen, double sigma_px, const SE3& cam_T_tag) {
  Eigen::Matrix<double, 8, 1> e;
  for (std::size_t i = 0; i < 4; ++i) {
    e.segment<2>(static_cast<Eigen::Index>(2 * i)) =
        camera.project(cam_T_tag * testing::tag_corners().at(i)).value() - seen.corners_px.at(i);
  }
  if (!seen.corner_covariance_px2) return e.squaredNorm() / (sigma_px * sigma_px);
  return e.dot(seen.corner_covariance_px2->inverse() * e);
}

TEST(TagPose, ExactWithoutNoise) {
  Random random(1);
  for (const CameraModel& camera :
       {testing::plain_camera(), testing::distorting_camera(), testing::fisheye_camera()}) {
    for (int trial = 0; trial < 700; ++trial) {
      const SE3 truth =
          testing::random_view(random, {.min_size_px = 15, .max_size_px = 250, .max_tilt_deg = 75});
      const auto seen = testing::see_tag(camera, truth);
      ASSERT_TRUE(seen);
      const auto pose = estimate_tag_pose(*seen, kTagSize, camera);
      ASSERT_TRUE(pose) << to_string(pose.error());
      EXPECT_THAT(pose->best.cam_T_tag, SE3Near(truth, 1e-9, 1e-9));
      EXPECT_LT(pose->best.rms_px, 1e-8);
      EXPECT_LT(pose->best.chi2, 1e-12);
      EXPECT_TRUE(!pose->other || pose->other->chi2 > pose->best.chi2);
    }
  }
}

TEST(TagPose, FisheyeTagsBeyondNinetyDegrees) {
  Random random(2);
  const CameraModel camera = testing::fisheye_camera();
  const SO3 sideways = SO3::exp({0, 1.62, 0});
  for (int trial = 0; trial < 50; ++trial) {
    const SE3 truth =
        SE3(sideways, Eigen::Vector3d::Zero()) * testing::random_view(random, {.max_off_axis = 0.05});
    const auto seen = testing::see_tag(camera, truth);
    ASSERT_TRUE(seen);
    const auto pose = estimate_tag_pose(*seen, kTagSize, camera);
    ASSERT_TRUE(pose) << to_string(pose.error());
    EXPECT_THAT(pose->best.cam_T_tag, SE3Near(truth, 1e-9, 1e-9));
  }
}

TEST(TagPose, BothSolutionsAreMinimaOfTheReprojectionError) {
  Random random(3);
  int both = 0;
  for (const CameraModel& camera : {testing::plain_camera(), testing::distorting_camera()}) {
    for (int trial = 0; trial < 150; ++trial) {
      const double sigma = 0.3;
      TagDetection seen = with_noise(see_tag(camera, testing::random_view(random)).value(), sigma, random);
      if (trial % 2 == 1) seen.corner_covariance_px2 = some_covariance(random);
      const auto pose = estimate_tag_pose(seen, kTagSize, camera, {.corner_sigma_px = sigma});
      ASSERT_TRUE(pose);
      both += pose->other.has_value() ? 1 : 0;
      for (const TagPoseSolution* s : {&pose->best, pose->other ? &*pose->other : &pose->best}) {
        EXPECT_NEAR(s->chi2, cost(camera, seen, sigma, s->cam_T_tag), 1e-5 * (1 + s->chi2));
        // A step of a twentieth of a standard deviation in any direction must increase the cost. The step is
        // scaled as if the residuals were noise. The tolerance of the iteration is smaller than this step.
        const double step = 0.05 * std::sqrt(1 + s->chi2 / 2);
        const Eigen::LLT<PoseCovariance> llt(s->covariance);
        for (int k = 0; k < 12; ++k) {
          const Vector6 direction = (k % 2 == 0 ? step : -step) * Vector6::Unit(k / 2);
          const SE3 moved = SE3::exp(llt.matrixL() * direction) * s->cam_T_tag;
          EXPECT_GT(cost(camera, seen, sigma, moved), cost(camera, seen, sigma, s->cam_T_tag));
        }
      }
    }
  }
  EXPECT_GT(both, 200);
}

TEST(TagPose, TheCovarianceIsTheInverseFisherInformation) {
  Random random(4);
  for (const CameraModel& camera : {testing::plain_camera(), testing::distorting_camera()}) {
    for (int trial = 0; trial < 40; ++trial) {
      TagDetection seen = see_tag(camera, testing::random_view(random, {.min_tilt_deg = 10})).value();
      seen.corner_covariance_px2 = some_covariance(random);
      const auto pose = estimate_tag_pose(seen, kTagSize, camera);
      ASSERT_TRUE(pose);
      const auto corners_px = [&](const Vector6& xi) {
        Eigen::Matrix<double, 8, 1> px;
        for (std::size_t i = 0; i < 4; ++i) {
          px.segment<2>(static_cast<Eigen::Index>(2 * i)) =
              camera.project(SE3::exp(xi) * pose->best.cam_T_tag * testing::tag_corners().at(i)).value();
        }
        return px;
      };
      const auto J = testing::numeric_jacobian<8, 6>(corners_px, Vector6::Zero().eval(), 1e-5);
      const PoseCovariance information = J.transpose() * seen.corner_covariance_px2->inverse() * J;
      EXPECT_THAT((information * pose->best.covariance).eval(), MatrixNear(PoseCovariance::Identity(), 1e-4));
    }
  }
}

/// A covariance of the parameters of any camera, with strong correlations.
IntrinsicsCovariance some_lens_covariance(const CameraModel& camera, Random& random) {
  const Eigen::VectorXd parameters = intrinsics_of(camera);
  Eigen::MatrixXd L(parameters.size(), parameters.size());
  for (double& entry : L.reshaped()) entry = random.normal();
  const Eigen::VectorXd sigma = 1e-4 * (parameters.array().abs() + 0.1).matrix();
  return sigma.asDiagonal() * L * L.transpose() * sigma.asDiagonal();
}

TagPoseOptions with_lens(const IntrinsicsCovariance& covariance) {
  TagPoseOptions options;
  options.intrinsics_covariance = covariance;
  return options;
}

TEST(TagPose, AnExactLensChangesNothing) {
  Random random(14);
  for (const CameraModel& camera : {testing::distorting_camera(), testing::fisheye_camera()}) {
    const Eigen::Index n = intrinsics_of(camera).size();
    for (int trial = 0; trial < 50; ++trial) {
      TagDetection seen = with_noise(see_tag(camera, testing::random_view(random)).value(), 0.3, random);
      if (trial % 2 == 1) seen.corner_covariance_px2 = some_covariance(random);
      const TagPose plain = estimate_tag_pose(seen, kTagSize, camera).value();
      const TagPose exact =
          estimate_tag_pose(seen, kTagSize, camera, with_lens(IntrinsicsCovariance::Zero(n, n))).value();
      EXPECT_EQ(plain.best.cam_T_tag.matrix(), exact.best.cam_T_tag.matrix());
      EXPECT_EQ(plain.best.covariance, exact.best.covariance);
      EXPECT_EQ(plain.best.chi2, exact.best.chi2);
      EXPECT_EQ(plain.best.sigma_scale, exact.best.sigma_scale);
      EXPECT_EQ(exact.best.lens_covariance, PoseCovariance::Zero());
      EXPECT_EQ(plain.other.has_value(), exact.other.has_value());
    }
  }
}

/// The oracle estimates the pose again for each parameter of the camera, slightly changed.
TEST(TagPose, TheLensCovarianceIsThatOfPosesFromOtherLenses) {
  Random random(15);
  for (const CameraModel& camera : {testing::distorting_camera(), testing::fisheye_camera()}) {
    const Eigen::VectorXd parameters = intrinsics_of(camera);
    for (int trial = 0; trial < 20; ++trial) {
      TagDetection seen = see_tag(camera, testing::random_view(random, {.min_tilt_deg = 15})).value();
      seen.corner_covariance_px2 = some_covariance(random);
      const IntrinsicsCovariance lens = some_lens_covariance(camera, random);
      const TagPose pose = estimate_tag_pose(seen, kTagSize, camera, with_lens(lens)).value();
      const auto away = [&](const Eigen::VectorXd& changed) -> Vector6 {
        const CameraModel other = with_intrinsics(camera, changed).value();
        return minus(estimate_tag_pose(seen, kTagSize, other).value().best.cam_T_tag, pose.best.cam_T_tag);
      };
      Eigen::MatrixXd G(6, parameters.size());
      for (Eigen::Index i = 0; i < parameters.size(); ++i) {
        const double h = 1e-6 * std::max(1.0, std::abs(parameters[i]));
        const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(parameters.size(), i);
        G.col(i) = (away(parameters + step) - away(parameters - step)) / (2 * h);
      }
      const PoseCovariance expected = G * lens * G.transpose();
      EXPECT_THAT(pose.best.lens_covariance, MatrixNear(expected, 2e-3 * expected.norm()));
      const TagPose exact = estimate_tag_pose(seen, kTagSize, camera).value();
      EXPECT_THAT(pose.best.covariance, MatrixNear(exact.best.covariance + pose.best.lens_covariance, 1e-15));
    }
  }
}

TEST(TagPose, TheLensCovarianceScalesThatOfThePose) {
  Random random(16);
  const CameraModel camera = testing::distorting_camera();
  const TagDetection seen = with_noise(see_tag(camera, testing::random_view(random)).value(), 0.1, random);
  const IntrinsicsCovariance lens = some_lens_covariance(camera, random);
  const TagPose one = estimate_tag_pose(seen, kTagSize, camera, with_lens(lens)).value();
  const TagPose nine = estimate_tag_pose(seen, kTagSize, camera, with_lens(9 * lens)).value();
  EXPECT_EQ(one.best.cam_T_tag.matrix(), nine.best.cam_T_tag.matrix());
  EXPECT_THAT(nine.best.lens_covariance,
              MatrixNear(9 * one.best.lens_covariance, 1e-9 * nine.best.lens_covariance.norm()));
  EXPECT_GT(one.best.lens_covariance.norm(), 0);
}

TEST(TagPose, AnInvalidLensCovarianceIsRejected) {
  Random random(17);
  const CameraModel camera = testing::distorting_camera();
  const TagDetection seen = see_tag(camera, testing::random_view(random)).value();
  const IntrinsicsCovariance valid = some_lens_covariance(camera, random);
  const Eigen::Index n = valid.rows();
  IntrinsicsCovariance asymmetric = valid;
  asymmetric(0, 1) += std::sqrt(valid(0, 0) * valid(1, 1));
  IntrinsicsCovariance indefinite = valid;
  indefinite(0, 1) = indefinite(1, 0) = 1.1 * std::sqrt(valid(0, 0) * valid(1, 1));
  IntrinsicsCovariance not_finite = valid;
  not_finite(2, 2) = std::numeric_limits<double>::quiet_NaN();
  for (const IntrinsicsCovariance& wrong :
       {IntrinsicsCovariance(valid.topLeftCorner(n - 1, n - 1)), IntrinsicsCovariance(valid.topRows(n - 1)),
        asymmetric, indefinite, not_finite, IntrinsicsCovariance(-valid)}) {
    const auto pose = estimate_tag_pose(seen, kTagSize, camera, with_lens(wrong));
    ASSERT_FALSE(pose);
    EXPECT_EQ(pose.error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(pose.error().place.key, "intrinsics_covariance");
  }
  EXPECT_TRUE(estimate_tag_pose(seen, kTagSize, camera, with_lens(valid)));
}

TEST(TagPose, NoiseScalesTheCovarianceButNotThePose) {
  Random random(5);
  const CameraModel camera = testing::plain_camera();
  const TagDetection seen = with_noise(see_tag(camera, testing::random_view(random)).value(), 0.2, random);
  const TagPose one = estimate_tag_pose(seen, kTagSize, camera, {.corner_sigma_px = 0.1}).value();
  const TagPose three = estimate_tag_pose(seen, kTagSize, camera, {.corner_sigma_px = 0.3}).value();
  EXPECT_THAT(one.best.cam_T_tag, SE3Near(three.best.cam_T_tag, 1e-5, 1e-5));
  EXPECT_THAT((9 * one.best.covariance).eval(),
              MatrixNear(three.best.covariance, 1e-4 * three.best.covariance.norm()));
  EXPECT_NEAR(one.best.chi2, 9 * three.best.chi2, 1e-4 * one.best.chi2);
  TagDetection full = seen;
  full.corner_covariance_px2 = 0.09 * CornerCovariance::Identity();
  const TagPose as_full = estimate_tag_pose(full, kTagSize, camera).value();
  EXPECT_THAT(as_full.best.covariance, MatrixNear(three.best.covariance, 1e-9));
  EXPECT_THAT(as_full.best.cam_T_tag, SE3Near(three.best.cam_T_tag, 1e-9, 1e-9));
}

TEST(TagPose, ScalesWithTheSizeOfTheTag) {
  Random random(6);
  const CameraModel camera = testing::plain_camera();
  const TagDetection seen = with_noise(see_tag(camera, testing::random_view(random)).value(), 0.2, random);
  const TagPose one = estimate_tag_pose(seen, 1.0, camera).value();
  for (const double size : {1e-3, 10.0, 1e4}) {
    const TagPose scaled = estimate_tag_pose(seen, size, camera).value();
    EXPECT_LT((scaled.best.cam_T_tag.translation() / size - one.best.cam_T_tag.translation()).norm(), 1e-6);
    EXPECT_NEAR(scaled.best.chi2, one.best.chi2, 1e-6);
    const PoseDeviations in_units = standard_deviations(scaled.best.cam_T_tag, scaled.best.covariance);
    const PoseDeviations of_one = standard_deviations(one.best.cam_T_tag, one.best.covariance);
    EXPECT_LT((in_units.position_m / size - of_one.position_m).norm(), 1e-6);
    EXPECT_LT((in_units.rotation_rad - of_one.rotation_rad).norm(), 1e-6);
  }
}

TEST(TagPose, ACornerWithLargeVarianceHasLittleWeight) {
  Random random(7);
  const CameraModel camera = testing::plain_camera();
  const SE3 truth = testing::random_view(random, {.min_tilt_deg = 30});
  TagDetection seen = see_tag(camera, truth).value();
  seen.corners_px[2] += Eigen::Vector2d(3, -2);
  seen.corner_covariance_px2 = 0.01 * CornerCovariance::Identity();
  const SE3 pulled = estimate_tag_pose(seen, kTagSize, camera).value().best.cam_T_tag;
  seen.corner_covariance_px2->block<2, 2>(4, 4) *= 1e6;
  const SE3 freed = estimate_tag_pose(seen, kTagSize, camera).value().best.cam_T_tag;
  EXPECT_LT(testing::internal::distance(truth, freed).rotation,
            0.01 * testing::internal::distance(truth, pulled).rotation);
}

TEST(TagPose, AResidualBeyondChanceScalesTheCovariance) {
  Random random(17);
  const CameraModel camera = testing::plain_camera();
  const SE3 truth(SO3::exp({0.5, 0.2, 0.3}), {0.1, 0, 2.0});
  TagDetection seen = see_tag(camera, truth).value();
  double last = 1;
  for (double bent_px = 0; bent_px < 2; bent_px += 0.01) {
    seen.corners_px = see_tag(camera, truth).value().corners_px;
    // The image of a square under perspective is determined by its pose, which cannot explain a single wrong
    // corner.
    seen.corners_px[0] += Eigen::Vector2d(bent_px, -bent_px);
    const TagPose pose = estimate_tag_pose(seen, kTagSize, camera, {.corner_sigma_px = 0.1}).value();
    // The same corners with a claim that they keep: the unscaled covariance is proportional to it.
    const TagPose kept = estimate_tag_pose(seen, kTagSize, camera, {.corner_sigma_px = 10}).value();
    ASSERT_EQ(kept.best.sigma_scale, 1);
    const double scale = pose.best.sigma_scale;
    EXPECT_THAT((1e-4 * scale * scale * kept.best.covariance).eval(),
                MatrixNear(pose.best.covariance, 1e-3 * pose.best.covariance.norm()));
    if (pose.other) EXPECT_EQ(pose.other->sigma_scale, scale) << "the corners are the same";
    EXPECT_GE(scale, last);
    EXPECT_LT(scale, 1.5 * last) << "rises without a jump";
    if (pose.best.chi2 < 13) EXPECT_EQ(scale, 1);
    if (pose.best.chi2 > 30) EXPECT_NEAR(scale * scale, pose.best.chi2 / 2, 1e-9 * pose.best.chi2);
    last = scale;
  }
  EXPECT_GT(last, 5);
}

TEST(TagPose, ReportsWhyThereIsNoSecondSolution) {
  const CameraModel camera = testing::plain_camera();
  // For a frontal tag, both solutions coincide,
  const SE3 frontal(SO3(), {0, 0, 1.0});
  const TagPose facing = estimate_tag_pose(see_tag(camera, frontal).value(), kTagSize, camera).value();
  EXPECT_FALSE(facing.other);
  EXPECT_EQ(facing.other_state, OtherSolution::SameMinimum);
  EXPECT_EQ(facing.ambiguity_ratio(), 0);
  EXPECT_EQ(facing.likelihood_ratio(), 0);
  // a tag that fills the view has no second minimum,
  const SE3 close(SO3::exp({0.9, 0.2, 0.3}), {0, 0, 0.15});
  EXPECT_FALSE(estimate_tag_pose(see_tag(camera, close).value(), kTagSize, camera).value().other);
  // and a small tilted tag has a second solution that fits nearly as well.
  const SE3 far(SO3::exp({0.5, 0.2, 0.3}), {0.1, 0, 5.0});
  Random random(8);
  const TagPose two =
      estimate_tag_pose(with_noise(see_tag(camera, far).value(), 0.1, random), kTagSize, camera).value();
  ASSERT_TRUE(two.other);
  EXPECT_EQ(two.other_state, OtherSolution::Found);
  EXPECT_GT(two.ambiguity_ratio(), 0.1);
  EXPECT_LE(two.ambiguity_ratio(), 1);
  EXPECT_NEAR(two.likelihood_ratio(), std::exp((two.best.chi2 - two.other->chi2) / 2), 1e-15);
}

TEST(TagPose, LooksUpTheSizeById) {
  const CameraModel camera = testing::plain_camera();
  const SE3 truth(SO3::exp({0.5, 0, 0}), {0, 0, 1.0});
  const TagSizes sizes{.default_size_m = 1.0, .size_by_tag_m = {{{FamilyId::Tag36h11, 7}, kTagSize}}};
  const auto pose = estimate_tag_pose(see_tag(camera, truth, kTagSize, 7).value(), sizes, camera);
  EXPECT_THAT(pose.value().best.cam_T_tag, SE3Near(truth, 1e-9, 1e-9));
  EXPECT_FALSE(estimate_tag_pose(see_tag(camera, truth).value(), TagSizes{}, camera));
}

TEST(TagPose, SameInputSameBits) {
  Random random(10);
  const CameraModel camera = testing::distorting_camera();
  const TagDetection seen = with_noise(see_tag(camera, testing::random_view(random)).value(), 0.2, random);
  const TagPose a = estimate_tag_pose(seen, kTagSize, camera).value();
  const TagPose b = estimate_tag_pose(seen, kTagSize, camera).value();
  EXPECT_EQ(a.best.cam_T_tag, b.best.cam_T_tag);
  EXPECT_EQ(a.best.covariance, b.best.covariance);
}

// Rotating by sigma about the camera's x axis moves a tag at distance z by z sigma along y, so a pure
// rotation in the tangent changes the position.
TEST(StandardDeviations, AreThoseOfThePosition) {
  PoseCovariance covariance = PoseCovariance::Zero();
  covariance(3, 3) = 0.01 * 0.01;
  const PoseDeviations d = standard_deviations(SE3(SO3::exp({0.3, 1, 2}), {0, 0, 5.0}), covariance);
  EXPECT_THAT(d.position_m, MatrixNear(Eigen::Vector3d(0, 0.05, 0), 1e-12));
  EXPECT_THAT(d.rotation_rad, MatrixNear(Eigen::Vector3d(0.01, 0, 0), 1e-12));
}

// Tests for corners that cannot be used.

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

TEST(TagPose, RejectsInvalidDetections) {
  const CameraModel camera = testing::distorting_camera();
  const TagDetection good = see_tag(camera, SE3(SO3::exp({0.5, 0, 0}), {0, 0, 1.0}), kTagSize, 7).value();
  ASSERT_TRUE(estimate_tag_pose(good, kTagSize, camera));
  struct Case {
    TagDetection seen;
    double size_m;
    const char* text;
  };
  std::vector<Case> cases;
  for (const double size : {0.0, -1.0, kNan, kInf}) cases.push_back({good, size, " m"});
  const auto with_corners = [&](auto&& change) {
    TagDetection seen = good;
    change(seen.corners_px);
    return seen;
  };
  cases.push_back({with_corners([](auto& c) { c[1].x() = kNan; }), 1, "TR"});
  cases.push_back({with_corners([](auto& c) { c[3].y() = -kInf; }), 1, "BL"});
  cases.push_back({with_corners([](auto& c) {
                     c[2] = {1e6, 2e6};
                   }),
                   1, "corner BR at (1000000.0, 2000000.0) px"});
  cases.push_back({with_corners([](auto& c) { c[2] = c[1]; }), 1, "two"});
  cases.push_back({with_corners([](auto& c) { c.fill({320, 240}); }), 1, "two"});
  cases.push_back({with_corners([](auto& c) { std::swap(c[0], c[1]); }), 1, "order TL, TR, BR, BL"});
  cases.push_back({with_corners([](auto& c) { std::swap(c[1], c[3]); }), 1, "counter-clockwise"});
  TagDetection no_covariance = good;
  no_covariance.corner_covariance_px2 = -CornerCovariance::Identity();
  cases.push_back({no_covariance, 1, "covariance"});
  TagDetection unreliable = good;
  unreliable.corner_state = CornerState::Unreliable;
  cases.push_back({unreliable, 1, "unreliable"});
  for (const Case& c : cases) {
    const auto pose = estimate_tag_pose(c.seen, c.size_m, camera);
    ASSERT_FALSE(pose) << c.text;
    EXPECT_EQ(pose.error().code, ErrorCode::InvalidArgument);
    EXPECT_THAT(pose.error().message, HasSubstr(c.text));
    EXPECT_EQ(pose.error().place.key, "tag36h11:7") << "the error names the tag";
    EXPECT_FALSE(pose.error().hint.empty());
    testing::expect_on_page("pose", pose.error());
  }
  EXPECT_FALSE(estimate_tag_pose(good, 1, camera, {.corner_sigma_px = 0}));
  EXPECT_FALSE(estimate_tag_pose(good, 1, camera, {.corner_sigma_px = kNan}));
  EXPECT_FALSE(estimate_tag_pose(good, 1, camera, {.max_iterations = 0}));
  // Three collinear corners; there is no lens distortion.
  TagDetection line = good;
  line.corners_px = {{{100, 100}, {200, 100}, {300, 100}, {100, 200}}};
  EXPECT_THAT(estimate_tag_pose(line, 1, testing::plain_camera()).error().message, HasSubstr("collinear"));
}

TEST(TagPose, RandomInputGivesAnErrorOrFiniteResults) {
  Random random(9);
  const double odd[] = {0, kNan, kInf, -kInf, 1e300, -1e-300, 320, 240, 1e9};
  int poses = 0;
  for (const CameraModel& camera :
       {testing::plain_camera(), testing::distorting_camera(), testing::fisheye_camera()}) {
    for (int trial = 0; trial < 5000; ++trial) {
      TagDetection seen;
      const double scale = std::pow(10, random.uniform(-6, 4));
      for (auto& corner : seen.corners_px) {
        corner = Eigen::Vector2d(320, 240) + scale * Eigen::Vector2d(random.normal(), random.normal());
        if (random.index(20) == 0)
          corner[static_cast<int>(random.index(2))] = odd[random.index(std::size(odd))];
      }
      if (random.index(4) == 0)
        seen.corner_covariance_px2 = some_covariance(random) * std::pow(10, random.uniform(-20, 20));
      const auto pose = estimate_tag_pose(seen, std::pow(10, random.uniform(-6, 6)), camera);
      if (!pose) continue;
      ++poses;
      for (const TagPoseSolution* s : {&pose->best, pose->other ? &*pose->other : &pose->best}) {
        EXPECT_TRUE(s->cam_T_tag.matrix().allFinite());
        EXPECT_TRUE(s->covariance.allFinite());
        EXPECT_TRUE(std::isfinite(s->chi2) && std::isfinite(s->rms_px));
      }
      EXPECT_TRUE(std::isfinite(pose->ambiguity_ratio()) && std::isfinite(pose->likelihood_ratio()));
    }
  }
  EXPECT_GT(poses, 100);
}

// Monte Carlo tests: the estimate must be as accurate as the corners allow, and its covariance must be
// consistent.

using testing::ViewRange;

/// Factor by which the full test (test.sh) runs longer Monte Carlo simulations.
int effort() { return std::getenv("WAYMARK_FULL") == nullptr ? 1 : 5; }

struct Statistics {
  int count = 0;
  double squared_position = 0, squared_rotation = 0;  ///< sums of squared errors
  /// Cramér-Rao bound: the smallest possible expectation of the squared error
  double bound_position = 0, bound_rotation = 0;
  double nees = 0;

  [[nodiscard]] double position_ratio() const { return std::sqrt(squared_position / bound_position); }
  [[nodiscard]] double rotation_ratio() const { return std::sqrt(squared_rotation / bound_rotation); }
  [[nodiscard]] double mean_nees() const { return nees / count; }
  /// Half the width of the 0.95 interval for the mean of `count` draws from a chi-square distribution with 6
  /// degrees of freedom.
  [[nodiscard]] double nees_margin() const { return 1.96 * std::sqrt(12.0 / count); }
};

/// The solution whose rotation is nearest to the truth, because the choice between the two is not tested
/// here.
const TagPoseSolution& nearest(const TagPose& pose, const SE3& truth) {
  const auto angle = [&](const TagPoseSolution& s) {
    return (s.cam_T_tag.rotation().inverse() * truth.rotation()).angle();
  };
  return pose.other && angle(*pose.other) < angle(pose.best) ? *pose.other : pose.best;
}

Statistics run(const CameraModel& camera, const ViewRange& range, double sigma_px, int count,
               std::uint64_t seed, const std::optional<CornerCovariance>& covariance = {}) {
  Random random(seed);
  Statistics sum;
  while (sum.count < count) {
    const SE3 truth = testing::random_view(random, range);
    TagDetection clean = see_tag(camera, truth).value();
    clean.corner_covariance_px2 = covariance;
    TagDetection seen = clean;
    if (covariance) {
      Eigen::Matrix<double, 8, 1> white;
      for (double& w : white.reshaped()) w = random.normal();
      const Eigen::Matrix<double, 8, 1> noise = Eigen::LLT<CornerCovariance>(*covariance).matrixL() * white;
      for (std::size_t i = 0; i < 4; ++i)
        seen.corners_px.at(i) += noise.segment<2>(static_cast<Eigen::Index>(2 * i));
    } else {
      seen = with_noise(seen, sigma_px, random);
    }
    const TagPoseOptions options{.corner_sigma_px = sigma_px};
    const auto pose = estimate_tag_pose(seen, kTagSize, camera, options);
    // Without noise, the covariance equals the bound (another test checks that it is the inverse of the
    // Fisher information).
    const auto bound = estimate_tag_pose(clean, kTagSize, camera, options);
    EXPECT_TRUE(pose && bound);
    if (!pose || !bound) break;
    const TagPoseSolution& found = nearest(*pose, truth);
    const SE3::Tangent error = minus(truth, found.cam_T_tag);
    sum.nees += error.dot(Eigen::LLT<PoseCovariance>(found.covariance).solve(error));
    sum.squared_position += (truth.translation() - found.cam_T_tag.translation()).squaredNorm();
    sum.squared_rotation += error.tail<3>().squaredNorm();
    const auto deviations = standard_deviations(truth, bound->best.covariance);
    sum.bound_position += deviations.position_m.squaredNorm();
    sum.bound_rotation += deviations.rotation_rad.squaredNorm();
    ++sum.count;
  }
  return sum;
}

void expect_efficient_and_consistent(const char* what, const Statistics& s) {
  std::cout << what << ": RMSE / bound position " << s.position_ratio() << ", rotation " << s.rotation_ratio()
            << ", NEES " << s.mean_nees() << " (6 +- " << s.nees_margin() << ") of " << s.count << "\n";
  EXPECT_LT(s.position_ratio(), 1.1) << what;
  EXPECT_LT(s.rotation_ratio(), 1.1) << what;
  // A result better than the bound would mean that the bound is wrong.
  EXPECT_GT(s.position_ratio(), 0.9) << what;
  EXPECT_GT(s.rotation_ratio(), 0.9) << what;
  EXPECT_NEAR(s.mean_nees(), 6.0, s.nees_margin()) << what;
}

constexpr ViewRange kOrdinary{.min_size_px = 40, .max_size_px = 200, .min_tilt_deg = 20, .max_tilt_deg = 70};

TEST(TagPoseStatistics, ReachesTheBoundWithConsistentCovariance) {
  expect_efficient_and_consistent("plain",
                                  run(testing::plain_camera(), kOrdinary, 0.1, 20000 * effort(), 11));
}

TEST(TagPoseStatistics, WithADistortingLens) {
  expect_efficient_and_consistent("distorted",
                                  run(testing::distorting_camera(), kOrdinary, 0.1, 10000 * effort(), 12));
}

TEST(TagPoseStatistics, WithAFisheye) {
  expect_efficient_and_consistent("fisheye",
                                  run(testing::fisheye_camera(), kOrdinary, 0.1, 10000 * effort(), 13));
}

TEST(TagPoseStatistics, WithCorrelatedCorners) {
  Random random(14);
  CornerCovariance A;
  for (double& entry : A.reshaped()) entry = 0.04 * random.normal();
  const CornerCovariance covariance = A * A.transpose() + 0.001 * CornerCovariance::Identity();
  expect_efficient_and_consistent(
      "correlated", run(testing::plain_camera(), kOrdinary, 0.1, 10000 * effort(), 15, covariance));
}

// Small, nearly frontal tags are the difficult case: the first-order covariance is too small for them. The
// limits are measured values (table in docs/concepts/pose.md) and serve only to detect changes.
TEST(TagPoseStatistics, SmallTagsAreWorseThanTheirCovariance) {
  const ViewRange small{.min_size_px = 20, .max_size_px = 20, .min_tilt_deg = 0, .max_tilt_deg = 10};
  const Statistics s = run(testing::plain_camera(), small, 0.1, 5000 * effort(), 16);
  std::cout << "20 px, 0 to 10 deg: RMSE / bound position " << s.position_ratio() << ", rotation "
            << s.rotation_ratio() << ", NEES " << s.mean_nees() << "\n";
  EXPECT_LT(s.position_ratio(), 1.1);
  EXPECT_GT(s.mean_nees(), 6.5);
}

// The covariance where the claim is wrong. Two residuals are few, so the test asserts shares of the views.
struct Kept {
  double scaled = 0, claimed = 0;  ///< shares of errors inside the ellipsoid that should contain 95 %
};

Kept errors_inside(const CameraModel& truth, const CameraModel& assumed, double noise_px, double claim_px,
                   std::uint64_t seed) {
  constexpr double kQuantile = 12.59;  // 0.95 quantile of chi-square for 6 degrees of freedom
  constexpr int kViews = 2000;
  Random random(seed);
  Kept kept;
  for (int i = 0; i < kViews; ++i) {
    const SE3 cam_T_tag = testing::random_view(random, kOrdinary);
    const TagDetection seen = with_noise(see_tag(truth, cam_T_tag).value(), noise_px, random);
    const auto pose = estimate_tag_pose(seen, kTagSize, assumed, {.corner_sigma_px = claim_px});
    EXPECT_TRUE(pose);
    if (!pose) break;
    const TagPoseSolution& found = nearest(*pose, cam_T_tag);
    const SE3::Tangent error = minus(cam_T_tag, found.cam_T_tag);
    const double nees = error.dot(Eigen::LLT<PoseCovariance>(found.covariance).solve(error));
    kept.scaled += nees < kQuantile ? 1.0 / kViews : 0;
    kept.claimed += found.sigma_scale * found.sigma_scale * nees < kQuantile ? 1.0 / kViews : 0;
  }
  return kept;
}

TEST(TagPoseStatistics, TheResidualRevealsAWrongClaim) {
  const Kept noise = errors_inside(testing::plain_camera(), testing::plain_camera(), 1.0, 0.1, 18);
  const Kept lens = errors_inside(testing::distorting_camera(), testing::plain_camera(), 0.05, 0.05, 19);
  const Kept right = errors_inside(testing::plain_camera(), testing::plain_camera(), 0.1, 0.1, 20);
  std::cout << "errors in the 95 % ellipsoid as scaled (as claimed): noise x 10 " << noise.scaled << " ("
            << noise.claimed << "), wrong lens " << lens.scaled << " (" << lens.claimed << "), right "
            << right.scaled << " (" << right.claimed << ")\n";
  EXPECT_LT(noise.claimed, 0.02);
  EXPECT_GT(noise.scaled, 0.5);
  EXPECT_GT(lens.scaled, 2 * lens.claimed);
  EXPECT_NEAR(right.scaled, right.claimed, 0.002);
  EXPECT_NEAR(right.scaled, 0.95, 0.02);
}

// Comparison with OpenCV's IPPE_SQUARE, which was implemented by the authors of the method.

/// OpenCV expects corners with y up and z towards the viewer, that is, in our tag frame rotated by pi about
/// x.
const SO3 kTurned = SO3::exp({3.14159265358979323846, 0, 0});

std::vector<SE3> opencv_poses(const PinholeRadtan& lens, const TagDetection& seen) {
  const float h = static_cast<float>(kTagSize / 2);
  const std::vector<cv::Point3f> corners = {{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
  std::vector<cv::Point2d> px;
  for (const auto& p : seen.corners_px) px.emplace_back(p.x() - 0.5, p.y() - 0.5);
  const cv::Matx33d K(lens.fx, 0, lens.cx - 0.5, 0, lens.fy, lens.cy - 0.5, 0, 0, 1);
  const std::vector<double> k(lens.k.begin(), lens.k.begin() + lens.coefficients);
  std::vector<cv::Vec3d> r, t;
  cv::solvePnPGeneric(corners, px, K, k, r, t, false, cv::SOLVEPNP_IPPE_SQUARE);
  std::vector<SE3> poses;
  for (std::size_t i = 0; i < r.size(); ++i) {
    poses.emplace_back(SO3::exp({r[i][0], r[i][1], r[i][2]}) * kTurned,
                       Eigen::Vector3d(t[i][0], t[i][1], t[i][2]));
  }
  return poses;
}

double rms_px(const CameraModel& camera, const TagDetection& seen, const SE3& cam_T_tag) {
  double squared = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto px = camera.project(cam_T_tag * testing::tag_corners().at(i));
    if (!px) return 1e9;
    squared += (*px - seen.corners_px.at(i)).squaredNorm();
  }
  return std::sqrt(squared / 4);
}

double angle_to_nearest(const SE3& pose, const SE3& a, const SE3& b) {
  return std::min((pose.rotation().inverse() * a.rotation()).angle(),
                  (pose.rotation().inverse() * b.rotation()).angle());
}

// OpenCV uses the same closed form, so both rotations agree, even for noisy corners.
TEST(SquarePoseOracle, BothRotationsMatchOpenCv) {
  Random random(1);
  const CameraModel camera = testing::plain_camera();
  const auto lens = std::get<PinholeRadtan>(camera.projection());
  for (int trial = 0; trial < 300; ++trial) {
    const SE3 truth = testing::random_view(random, {.min_tilt_deg = 15});
    const TagDetection seen = with_noise(see_tag(camera, truth).value(), 0.2, random);
    std::array<Eigen::Vector3d, 4> bearings;
    for (std::size_t i = 0; i < 4; ++i) bearings[i] = camera.unproject(seen.corners_px[i]).value();
    const SquarePoses ours = square_poses(bearings, kTagSize);
    for (const SE3& theirs : opencv_poses(lens, seen)) {
      EXPECT_LT(angle_to_nearest(theirs, ours.cam_T_tag[0], ours.cam_T_tag[1]), 1e-5);
    }
  }
}

TEST(TagPoseOracle, NeverFitsWorseThanOpenCv) {
  Random random(2);
  int better = 0;
  for (const CameraModel& camera : {testing::plain_camera(), testing::distorting_camera()}) {
    const auto lens = std::get<PinholeRadtan>(camera.projection());
    for (int trial = 0; trial < 300; ++trial) {
      const SE3 truth = testing::random_view(random, {.min_size_px = 20});
      const TagDetection seen = with_noise(see_tag(camera, truth).value(), 0.3, random);
      const auto ours = estimate_tag_pose(seen, kTagSize, camera);
      ASSERT_TRUE(ours) << to_string(ours.error());
      const double theirs = rms_px(camera, seen, opencv_poses(lens, seen).at(0));
      EXPECT_LE(ours->best.rms_px, theirs * (1 + 1e-5));
      better += ours->best.rms_px < 0.99 * theirs ? 1 : 0;
    }
  }
  EXPECT_GT(better, 100) << "refinement must improve the fit";
}

}  // namespace
}  // namespace waymark
