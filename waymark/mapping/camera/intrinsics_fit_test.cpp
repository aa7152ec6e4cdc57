// Tests the least-squares problem of a calibration, and its marks.
#include "waymark/mapping/camera/intrinsics_fit.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark::internal {
namespace {

constexpr double kSize = 0.04;
constexpr double kSigmaPx = 0.1;

Eigen::VectorXd truth() {
  return (Eigen::VectorXd(8) << 510, 505, 324, 238, -0.2, 0.05, 0.001, -0.001).finished();
}
FitOptions options() { return {.lens = LensModel::Radtan4, .width_px = 640, .height_px = 480}; }

/// A board of twelve tags seen from ten directions, with true poses.
std::vector<TargetView> views(std::uint64_t seed, double noise_px) {
  Random random(seed);
  const CameraModel camera = camera_of(LensModel::Radtan4, truth(), 640, 480).value();
  std::vector<TargetView> all;
  for (int i = 0; i < 10; ++i) {
    const double s = static_cast<double>(i);
    const SE3 cam_T_target(SO3::exp({0.6 * std::sin(s), 0.6 * std::cos(1.3 * s), 0.3 * std::sin(2 * s)}),
                           {0.05 * std::cos(s), 0.04 * std::sin(2 * s), 0.3 + 0.02 * s});
    TargetView view{.target_T_cam = cam_T_target.inverse()};
    for (int k = 0; k < 12; ++k) {
      const SE3 target_T_tag({}, {0.06 * (k % 4 - 1.5), 0.06 * (k / 4 - 1), 0});
      const auto corners = visible_corners(camera, cam_T_target * target_T_tag, kSize);
      if (!corners) continue;
      TagDetection detection{.corners_px = *corners};
      for (auto& corner : detection.corners_px)
        corner += noise_px * Eigen::Vector2d(random.normal(), random.normal());
      TargetMark mark{.key = k, .seen_px = {detection.corners_px.begin(), detection.corners_px.end()}};
      for (const auto& corner : tag_corners(kSize)) mark.target_points_m.emplace_back(target_T_tag * corner);
      view.marks.push_back(view_mark(mark, kSigmaPx).value());
    }
    all.push_back(std::move(view));
  }
  return all;
}

TEST(IntrinsicsFit, FindsTheTruthWithoutNoise) {
  auto seen = views(1, 0);
  Eigen::VectorXd start = truth();
  start.head<4>() += Eigen::Vector4d(15, -10, 5, -4);
  start[4] += 0.03;
  const auto fit = fit_intrinsics(seen, start, options());
  ASSERT_TRUE(fit);
  EXPECT_TRUE(fit->converged);
  EXPECT_LT((fit->parameters - truth()).norm(), 1e-3);
  EXPECT_LT(fit->chi2, 1e-4);
}

TEST(IntrinsicsFit, CovarianceIsConsistent) {
  double sum = 0;
  constexpr int kSeeds = 12;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    auto seen = views(seed, kSigmaPx);
    FitOptions whole = options();
    whole.huber_sigma = 0;
    const auto fit = fit_intrinsics(seen, truth(), whole);
    ASSERT_TRUE(fit && fit->information.size() > 0) << seed;
    const Eigen::VectorXd off = fit->parameters - truth();
    sum += off.dot(fit->information * off);
  }
  EXPECT_NEAR(sum / kSeeds, 8, 3.5 * std::sqrt(16.0 / kSeeds));
}

TEST(IntrinsicsFit, FixedParametersDoNotChange) {
  auto seen = views(2, kSigmaPx);
  FitOptions some = options();
  some.free_parameters = 4;
  Eigen::VectorXd start = truth();
  start[5] = 0.08;
  const auto fit = fit_intrinsics(seen, start, some);
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->parameters.tail(4), start.tail(4));
  EXPECT_EQ(fit->information.rows(), 4);
  EXPECT_NE(fit->parameters[0], start[0]);
}

TEST(IntrinsicsFit, EstimatesOnlyPosesForAFixedCamera) {
  auto seen = views(3, 0);
  const auto where = seen;
  Random random(4);
  for (TargetView& view : seen) {
    SE3::Tangent off;
    for (double& x : off) x = 0.02 * random.normal();
    view.target_T_cam = SE3::exp(off) * view.target_T_cam;
  }
  FitOptions poses = options();
  poses.free_parameters = 0;
  const auto fit = fit_intrinsics(seen, truth(), poses);
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->parameters, truth());
  for (std::size_t i = 0; i < seen.size(); ++i)
    EXPECT_LT(minus(seen[i].target_T_cam, where[i].target_T_cam).norm(), 1e-5) << i;
}

TEST(IntrinsicsFit, HasNoInformationIfAPoseIsNotDetermined) {
  auto seen = views(4, kSigmaPx);
  ASSERT_GT(fit_intrinsics(seen, truth(), options())->information.size(), 0);
  seen[3].marks = {seen[3].marks[0], seen[3].marks[0]};
  for (ViewMark& mark : seen[3].marks)  // four times the same point
    for (std::size_t i = 1; i < 4; ++i) {
      mark.seen.target_points_m[i] = mark.seen.target_points_m[0];
      mark.seen.seen_px[i] = mark.seen.seen_px[0];
    }
  const auto fit = fit_intrinsics(seen, truth(), options());
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->information.size(), 0);
}

TEST(IntrinsicsFit, TheOrderOfViewsDoesNotMatter) {
  auto forwards = views(5, kSigmaPx);
  auto backwards = forwards;
  std::ranges::reverse(backwards);
  const auto a = fit_intrinsics(forwards, truth(), options());
  const auto b = fit_intrinsics(backwards, truth(), options());
  ASSERT_TRUE(a && b);
  EXPECT_LT((a->parameters - b->parameters).norm(), 1e-4);
  EXPECT_NEAR(a->chi2, b->chi2, 1e-6 * a->chi2);
}

TEST(IntrinsicsFit, TheFrameOfTheBoardDoesNotMatter) {
  auto here = views(6, kSigmaPx);
  auto there = here;
  const SE3 by(SO3::exp({0.5, -0.3, 1}), {1, 2, 3});
  for (TargetView& view : there) {
    view.target_T_cam = by * view.target_T_cam;
    for (ViewMark& mark : view.marks)
      for (auto& point : mark.seen.target_points_m) point = by * point;
  }
  const auto a = fit_intrinsics(here, truth(), options());
  const auto b = fit_intrinsics(there, truth(), options());
  ASSERT_TRUE(a && b);
  EXPECT_LT((a->parameters - b->parameters).norm(), 1e-3);
}

TEST(IntrinsicsFit, UnusedTagsHaveNoEffect) {
  auto seen = views(7, kSigmaPx);
  auto more = seen;
  ViewMark wrong = more[2].marks[1];
  for (auto& corner : wrong.seen.seen_px) corner += Eigen::Vector2d(40, 10);
  wrong.used = false;
  more[2].marks.push_back(wrong);
  const auto a = fit_intrinsics(seen, truth(), options());
  const auto b = fit_intrinsics(more, truth(), options());
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->parameters, b->parameters);
}

TEST(IntrinsicsFit, RejectsAnInvalidStart) {
  auto seen = views(8, kSigmaPx);
  Eigen::VectorXd wrong = truth();
  wrong[0] = -1;
  EXPECT_FALSE(fit_intrinsics(seen, wrong, options()));
  std::vector<TargetView> none;
  EXPECT_FALSE(fit_intrinsics(none, truth(), options()));
  seen[0].target_T_cam = seen[0].target_T_cam * SE3({}, {0, 0, 2});  // the board is behind the camera
  EXPECT_FALSE(fit_intrinsics(seen, truth(), options()));
}

TEST(ViewMark, WhitensByItsCovarianceOrTheDefault) {
  TargetMark mark{.key = 1, .target_points_m = {{0, 0, 0}}, .seen_px = {{100, 50}}};
  const auto plain = view_mark(mark, 0.25);
  ASSERT_TRUE(plain);
  EXPECT_LT((plain->whitening - 4 * Eigen::Matrix2d::Identity()).norm(), 1e-12);
  EXPECT_TRUE(plain->used);
  Eigen::Matrix2d P;
  P << 0.04, 0.01, 0.01, 0.09;
  mark.covariance_px2 = P;
  const auto whitened = view_mark(mark, 0.25);
  ASSERT_TRUE(whitened);
  const Eigen::Matrix2d W = whitened->whitening;
  EXPECT_LT((W * P * W.transpose() - Eigen::Matrix2d::Identity()).norm(), 1e-12);
}

TEST(ViewMark, RejectsInvalidMeasurements) {
  const TargetMark good{.key = 1, .target_points_m = {{0, 0, 0}}, .seen_px = {{100, 50}}};
  std::vector<TargetMark> bad(8, good);
  bad[0].seen_px[0].x() = std::nan("");
  bad[1].target_points_m[0].z() = std::numeric_limits<double>::infinity();
  bad[2].seen_px.clear();
  bad[3].target_points_m.emplace_back(1, 0, 0);
  bad[4].covariance_px2 = Eigen::Matrix2d::Zero();
  bad[5].covariance_px2 = -Eigen::Matrix2d::Identity();
  bad[6].covariance_px2 = Eigen::Matrix3d::Identity();
  bad[7].seen_px.assign(5, {1, 2});
  bad[7].target_points_m.assign(5, {0, 0, 0});
  for (std::size_t i = 0; i < bad.size(); ++i) {
    const auto mark = view_mark(bad[i], 0.2);
    ASSERT_FALSE(mark) << i;
    EXPECT_EQ(mark.error().code, ErrorCode::InvalidArgument) << i;
  }
  EXPECT_TRUE(view_mark(good, 0.2));
}

TEST(MarkProjection, MatchesTheCameraAndChiSquareMatchesTheResidual) {
  const CameraModel camera =
      CameraModel::make(
          PinholeRadtan{.fx = 500, .fy = 510, .cx = 320, .cy = 240, .k = {-0.1}, .coefficients = 4}, 640, 480)
          .value();
  TargetView view{.target_T_cam = SE3(SO3::exp({0.1, -0.2, 0.3}), {0.02, 0.01, -0.5})};
  const SE3 cam_T_target = view.target_T_cam.inverse();
  TargetMark mark{.key = 0};
  for (const auto& corner : tag_corners(0.04)) {
    mark.target_points_m.push_back(corner);
    mark.seen_px.push_back(*camera.project(cam_T_target * corner) + Eigen::Vector2d(0.3, -0.4));
  }
  const ViewMark seen = view_mark(mark, 0.5).value();
  const auto px = projected(seen, camera_points(seen, cam_T_target), camera);
  ASSERT_TRUE(px);
  for (Eigen::Index i = 0; i < 4; ++i)
    EXPECT_LT((px->segment<2>(2 * i) - mark.seen_px[static_cast<std::size_t>(i)] - Eigen::Vector2d(-0.3, 0.4))
                  .norm(),
              1e-12);
  EXPECT_NEAR(*mark_chi2(seen, view, camera), 4.0, 1e-9) << "four errors of 0.5 px at a sigma of 0.5 px";
  view.target_T_cam = SE3({}, {0, 0, 0.5});
  EXPECT_FALSE(mark_chi2(seen, view, camera)) << "behind the camera";
}

}  // namespace
}  // namespace waymark::internal
