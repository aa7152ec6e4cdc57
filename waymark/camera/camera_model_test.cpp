#include "waymark/camera/camera_model.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_camera.hpp"

namespace waymark {
namespace {

using testing::any_camera;
using testing::direction;
using ::testing::HasSubstr;
using testing::near_one;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

CameraModel must(const Result<CameraModel>& camera) {
  EXPECT_TRUE(camera) << to_string(camera.error());
  return camera.value();
}

CameraModel pinhole() {
  return must(CameraModel::make(PinholeRadtan{.fx = 100, .fy = 200, .cx = 32, .cy = 24}, 64, 48));
}
CameraModel webcam() {
  return must(CameraModel::make(PinholeRadtan{.fx = 603.7,
                                              .fy = 602.1,
                                              .cx = 322.1,
                                              .cy = 238.4,
                                              .k = {0.08, -0.21, 0.001, -0.002, 0.05},
                                              .coefficients = 5},
                                640, 480));
}
CameraModel fisheye() {
  return must(CameraModel::make(
      Equidistant{.fx = 190, .fy = 190.5, .cx = 320, .cy = 240, .k = {0.02, -0.01, 0.003, -0.0003}}, 640,
      480));
}

Error error_of(const CameraModel::Projection& projection, int width = 640, int height = 480) {
  const auto camera = CameraModel::make(projection, width, height);
  return camera ? Error{.message = "no error"} : camera.error();
}

/// Expects an error at `key` whose message contains `text`, which is the invalid value.
void expect_rejected(const Error& error, const std::string& key, const std::string& text) {
  EXPECT_EQ(error.code, ErrorCode::InvalidArgument);
  EXPECT_EQ(error.place.key, key);
  EXPECT_THAT(error.message, HasSubstr(text));
  EXPECT_FALSE(error.hint.empty());
  testing::expect_on_page("cameras", error);
}

/// Round-trip error of unproject() and project() for a pixel, in px. Allows a relative error of 1e-13 for
/// pixels beyond 10000.
double round_trip_error(const CameraModel& camera, const Eigen::Vector2d& px) {
  const auto bearing = camera.unproject(px);
  if (!bearing || std::abs(bearing->norm() - 1.0) > 1e-15) return kInfinity;
  const auto again = camera.project(*bearing);
  return again ? (*again - px).norm() / std::max(1.0, px.norm() * 1e-4) : kInfinity;
}

TEST(CameraModel, ProjectsAPinholeByHand) {
  const auto px = pinhole().project({0.1, -0.05, 2.0});
  ASSERT_TRUE(px);
  EXPECT_DOUBLE_EQ(px->x(), 37.0);
  EXPECT_DOUBLE_EQ(px->y(), 19.0);
}

TEST(CameraModel, ProjectsRadialAndTangentialTermsByHand) {
  const PinholeRadtan lens{
      .fx = 1, .fy = 1, .cx = 0, .cy = 0, .k = {0.1, 0.2, 0.01, 0.02}, .coefficients = 4};
  const auto px = must(CameraModel::make(lens, 1, 1)).project({0.5, 1.0, 1.0});
  ASSERT_TRUE(px);  // r^2 = 1.25, g = 1 + 0.125 + 0.3125
  EXPECT_DOUBLE_EQ(px->x(), 0.5 * 1.4375 + 2 * 0.01 * 0.5 + 0.02 * (1.25 + 0.5));
  EXPECT_DOUBLE_EQ(px->y(), 1.0 * 1.4375 + 0.01 * (1.25 + 2.0) + 2 * 0.02 * 0.5);
}

TEST(CameraModel, ProjectsAFisheyeByHand) {
  const Equidistant lens{.fx = 100, .fy = 100, .cx = 200, .cy = 200, .k = {0.01, 0.001, 0, 0}};
  const auto px = must(CameraModel::make(lens, 400, 400)).project({0.0, 3.0, 0.0});  // 90 degrees downwards
  ASSERT_TRUE(px);
  const double t = std::numbers::pi / 2;
  EXPECT_NEAR(px->x(), 200, 1e-12);
  EXPECT_NEAR(px->y(), 200 + 100 * t * (1 + 0.01 * t * t + 0.001 * t * t * t * t), 1e-11);
}

TEST(CameraModel, APinholeProjectsNothingBehindIt) {
  EXPECT_FALSE(pinhole().project({0.1, -0.05, -2.0}));
  EXPECT_FALSE(pinhole().project({0.1, -0.05, 0.0}));
  EXPECT_FALSE(pinhole().project({0.0, 0.0, 0.0}));
  EXPECT_DOUBLE_EQ(pinhole().max_angle_rad(), std::numbers::pi / 2);
}

TEST(CameraModel, AFisheyeProjectsPointsBehindIt) {
  const CameraModel camera = fisheye();
  ASSERT_GT(camera.max_angle_rad(), 2.0);
  const Eigen::Vector3d cam_p(std::sin(1.9), 0, std::cos(1.9));
  ASSERT_LT(cam_p.z(), 0);
  const auto px = camera.project(5 * cam_p);
  ASSERT_TRUE(px);
  const auto bearing = camera.unproject(*px);
  ASSERT_TRUE(bearing);
  EXPECT_LT((*bearing - cam_p).norm(), 1e-14);
  EXPECT_FALSE(camera.normalize(*px)) << "x/z of a point behind the camera is meaningless";
  EXPECT_FALSE(camera.project({0, 0, -1})) << "straight behind, the direction is undefined";
}

TEST(CameraModel, ContainsItsPixelsHalfOpen) {
  EXPECT_TRUE(pinhole().contains({0, 0}));
  EXPECT_TRUE(pinhole().contains({63.999, 47.999}));
  EXPECT_FALSE(pinhole().contains({64, 10}));
  EXPECT_FALSE(pinhole().contains({10, -1e-9}));
  EXPECT_FALSE(pinhole().contains({kNan, 10}));
}

TEST(CameraModel, ExtremePointsAndPixelsDoNotOverflow) {
  for (const CameraModel& camera : {pinhole(), webcam(), fisheye()}) {
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
      for (int i = 0; i < 3; ++i) {
        Eigen::Vector3d cam_p(0.1, 0.1, 1.0);
        cam_p[i] = bad;
        const auto px = camera.project(cam_p);
        EXPECT_FALSE(px) << cam_p.transpose();
      }
      EXPECT_FALSE(camera.unproject({bad, 10}));
      EXPECT_FALSE(camera.normalize({10, bad}));
    }
    for (const double huge : {1e-320, 1e-200, 1e100, 1e200, 1e308}) {
      for (const Eigen::Vector3d& cam_p :
           {Eigen::Vector3d(huge, 1, 1), Eigen::Vector3d(1, huge, huge), Eigen::Vector3d(1, 1, huge)}) {
        Matrix23 J = Matrix23::Zero();
        const auto px = camera.project(cam_p, &J);
        EXPECT_TRUE(!px || (px->allFinite() && J.allFinite())) << cam_p.transpose();
      }
      const auto bearing = camera.unproject({huge, -huge});
      EXPECT_TRUE(!bearing || bearing->allFinite());
    }
  }
}

TEST(CameraModel, RejectsInvalidParameters) {
  const PinholeRadtan good{.fx = 600, .fy = 600, .cx = 320, .cy = 240};
  EXPECT_TRUE(CameraModel::make(good, 640, 480));
  PinholeRadtan bad = good;
  bad.fx = -600;
  expect_rejected(error_of(bad), "fx", "-600");
  bad = good;
  bad.fy = kNan;
  expect_rejected(error_of(bad), "fy", "nan");
  bad = good;
  bad.cx = kInfinity;
  expect_rejected(error_of(bad), "cx", "inf");
  bad = good;
  bad.k[0] = kNan;
  bad.coefficients = 4;
  expect_rejected(error_of(bad), "distortion", "nan");
  bad = good;
  bad.coefficients = 6;
  expect_rejected(error_of(bad), "distortion", "6");
  bad = good;
  bad.k[4] = 0.1;
  bad.coefficients = 4;
  expect_rejected(error_of(bad), "distortion", "4");
  expect_rejected(error_of(good, 0, 480), "resolution", "0x480");
  expect_rejected(error_of(good, 640, -1), "resolution", "640x-1");
  expect_rejected(error_of(Equidistant{.fx = 0, .fy = 1, .cx = 1, .cy = 1}), "fx", "0");
}

TEST(CameraModel, RejectsADistortionThatFoldsInsideTheImage) {
  // r (1 - r^2 / 2) has the slope 1 - 3/2 r^2, which is zero at r = 0.8165; the distorted radius there is
  // 0.5443, or 327 px.
  PinholeRadtan lens{.fx = 600, .fy = 600, .cx = 320, .cy = 400, .k = {-0.5}, .coefficients = 4};
  EXPECT_TRUE(CameraModel::make(lens, 640, 800))
      << "the fold at 327 px is beyond the nearest edge at 320 px, so only corners are lost";
  lens.fx = lens.fy = 500;
  EXPECT_TRUE(CameraModel::make(lens, 640, 800)) << "the domain within 272 px covers 45 % of the image";
  lens.fx = lens.fy = 300;
  expect_rejected(error_of(lens, 640, 800), "distortion", "39.2 degrees off the axis, 163 px");
  EXPECT_THAT(error_of(lens, 640, 800).message, HasSubstr("16 %"));
  const Equidistant folding{.fx = 300, .fy = 300, .cx = 320, .cy = 240, .k = {-0.8, 0, 0, 0}};
  expect_rejected(error_of(folding), "distortion", "37.0 degrees");
}

// r (1 - 0.4 r^2) grows up to 304 px from the principal point, and the nearest edge is 360 px away.
TEST(CameraModel, ADomainInsideTheImageIsUsed) {
  const PinholeRadtan lens{.fx = 500, .fy = 500, .cx = 640, .cy = 360, .k = {-0.4}, .coefficients = 4};
  const CameraModel camera = must(CameraModel::make(lens, 1280, 720));
  EXPECT_NEAR(camera.max_angle_rad(), std::atan(std::sqrt(1 / 1.2)), 1e-9);
  EXPECT_LT(round_trip_error(camera, {640 + 303, 360}), 1e-9);
  EXPECT_FALSE(camera.unproject({640 + 305, 360}));
  EXPECT_FALSE(camera.reaches_an_edge());
  EXPECT_TRUE(
      must(CameraModel::make(
               PinholeRadtan{.fx = 500, .fy = 500, .cx = 640, .cy = 300, .k = {-0.4}, .coefficients = 4},
               1280, 600))
          .reaches_an_edge());
  EXPECT_TRUE(camera.covers(std::array{Eigen::Vector2d(640, 360), Eigen::Vector2d(900, 300)}));
  EXPECT_FALSE(camera.covers(std::array{Eigen::Vector2d(640, 360), Eigen::Vector2d(1000, 360)}));
}

TEST(CameraModel, ACircularFisheyeMayEndInsideItsImage) {
  // theta - 0.1 theta^3 folds at 1.826 rad (105 degrees), 1.217 focal lengths from the centre.
  const Equidistant circular{.fx = 180, .fy = 180, .cx = 320, .cy = 240, .k = {-0.1, 0, 0, 0}};
  const CameraModel camera = must(CameraModel::make(circular, 640, 480));
  EXPECT_NEAR(camera.max_angle_rad(), std::sqrt(1 / 0.3), 1e-12);
  EXPECT_TRUE(camera.unproject({320 + 219, 240}));
  EXPECT_FALSE(camera.unproject({320 + 220, 240})) << "black rim of the image";
}

TEST(CameraModel, TheRimOfAFoldRoundTripsInEveryDirection) {
  // Where the distortion is flat, rounding may move a pixel beyond the edge of the domain.
  const CameraModel camera = must(CameraModel::make(
      Equidistant{.fx = 211.3, .fy = 209.7, .cx = 320.1, .cy = 239.7, .k = {-0.1, 0, 0, 0}}, 640, 480));
  for (int i = 0; i < 1000; ++i) {
    const double angle = camera.max_angle_rad() * (1 - 1e-10);
    const double around = 0.006283 * i;
    const auto px = camera.project(
        {std::sin(angle) * std::cos(around), std::sin(angle) * std::sin(around), std::cos(angle)});
    ASSERT_TRUE(px);
    EXPECT_LT(round_trip_error(camera, *px), 1e-9) << around;
  }
}

TEST(CameraModel, APrincipalPointOutsideTheImageIsAccepted) {
  const CameraModel cropped =
      must(CameraModel::make(PinholeRadtan{.fx = 500, .fy = 500, .cx = -20, .cy = 100}, 200, 200));
  EXPECT_LT(round_trip_error(cropped, {1, 1}), 1e-9);
  const PinholeRadtan lens{.fx = 500, .fy = 500, .cx = -400, .cy = 100, .k = {-0.5}, .coefficients = 4};
  expect_rejected(error_of(lens, 200, 200), "distortion", "degrees off the axis");
}

TEST(CameraModel, RejectsImagesOfAnotherSize) {
  EXPECT_TRUE(check_camera_matches_image(webcam(), 640, 480));
  const Status status = check_camera_matches_image(webcam(), 1280, 720);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::InvalidArgument);
  testing::expect_on_page("cameras", status.error());
  EXPECT_FALSE(check_camera_matches_image(webcam(), 480, 640)) << "rotated by 90 degrees";
}

TEST(CameraModel, EveryPixelOfADenseGridRoundTrips) {
  for (const CameraModel& camera : {webcam(), fisheye()}) {
    double worst = 0;
    for (double y = 0; y <= camera.height_px(); y += 4) {
      for (double x = 0; x <= camera.width_px(); x += 4)
        worst = std::max(worst, round_trip_error(camera, {x, y}));
    }
    EXPECT_LT(worst, 1e-9);
  }
}

TEST(CameraModel, NormalizeAgreesWithUnproject) {
  for (const CameraModel& camera : {pinhole(), webcam(), fisheye()}) {
    const auto normalized = camera.normalize({140.25, 112.75});
    const auto bearing = camera.unproject({140.25, 112.75});
    ASSERT_TRUE(normalized && bearing);
    EXPECT_LT((*normalized - bearing->head<2>() / bearing->z()).norm(), 1e-14);
  }
}

RC_GTEST_PROP(CameraModelProperty, RoundTripIsExactEverywhereInTheDomain, ()) {
  const CameraModel camera = any_camera();
  // A pinhole camera reaches 90 degrees only at infinity; 84 degrees corresponds to ten focal lengths from
  // the centre.
  const bool is_pinhole = std::holds_alternative<PinholeRadtan>(camera.projection());
  const double reach =
      is_pinhole ? std::min(camera.max_angle_rad(), std::atan(10.0)) : camera.max_angle_rad();
  const Eigen::Vector3d cam_p = direction(reach * near_one());
  const auto px = camera.project(cam_p * testing::between(0.1, 10.0));
  RC_ASSERT(px.has_value());
  RC_ASSERT(round_trip_error(camera, *px) < 1e-9);
}

RC_GTEST_PROP(CameraModelProperty, APixelEitherComesBackOrIsSeenByNoPoint, ()) {
  const CameraModel camera = any_camera();
  const Eigen::Vector2d px(testing::between(-1000, 2000), testing::between(-1000, 2000));
  if (camera.unproject(px)) RC_ASSERT(round_trip_error(camera, px) < 1e-9);
}

RC_GTEST_PROP(CameraModelProperty, TwoPointsOfTheDomainNeverShareAPixel, ()) {
  const CameraModel camera = any_camera();
  const Eigen::Vector3d cam_p = direction(camera.max_angle_rad() * testing::between(1e-6, 0.98));
  const auto px = camera.project(cam_p);
  RC_ASSERT(px.has_value());
  const auto bearing = camera.unproject(*px);
  RC_ASSERT(bearing.has_value());
  RC_ASSERT((*bearing - cam_p).norm() < 1e-9);
}

RC_GTEST_PROP(CameraModelProperty, NothingBeyondTheDomain, ()) {
  const CameraModel camera = any_camera();
  const double beyond =
      camera.max_angle_rad() + (std::numbers::pi - camera.max_angle_rad()) * std::abs(testing::fraction());
  RC_PRE(beyond + 1e-12 < std::numbers::pi);
  RC_ASSERT(!camera.project(direction(beyond + 1e-12)).has_value());
}

TEST(ScaledCamera, ProjectsToTheScaledPixel) {
  const CameraModel radtan =
      CameraModel::make(
          PinholeRadtan{
              .fx = 600, .fy = 602, .cx = 318, .cy = 244, .k = {0.1, -0.2, 1e-3, 2e-3}, .coefficients = 4},
          640, 480)
          .value();
  const CameraModel fisheye =
      CameraModel::make(Equidistant{.fx = 300, .fy = 301, .cx = 322, .cy = 238, .k = {0.01, -0.002, 0, 0}},
                        640, 480)
          .value();
  for (const CameraModel& camera : {radtan, fisheye}) {
    const auto twice = scaled_camera(camera, 1280, 960);
    ASSERT_TRUE(twice);
    EXPECT_EQ(twice->width_px(), 1280);
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.1, -0.2, 1), Eigen::Vector3d(-0.3, 0.2, 0.9)})
      EXPECT_LT((*twice->project(p) - 2 * *camera.project(p)).norm(), 1e-9);
    EXPECT_EQ(scaled_camera(*twice, 640, 480).value(), camera);
  }
  EXPECT_TRUE(scaled_camera(radtan, 853, 640)) << "the size is rounded";
  const auto cropped = scaled_camera(radtan, 1280, 720);
  ASSERT_FALSE(cropped);
  EXPECT_EQ(cropped.error().code, ErrorCode::InvalidArgument);
  testing::expect_on_page("cameras", cropped.error());
  EXPECT_FALSE(scaled_camera(radtan, 0, 0));
  EXPECT_FALSE(scaled_camera(radtan, -640, -480));
}

RC_GTEST_PROP(CameraJacobian, AgreesWithNumericDifferences, ()) {
  const CameraModel camera = testing::any_camera();
  const double reach = std::min(camera.max_angle_rad(), std::atan(3.0));
  const Eigen::Vector3d cam_p =
      testing::between(0.3, 5.0) * testing::direction(reach * testing::between(0, 0.98));
  Matrix23 J;
  const auto px = camera.project(cam_p, &J);
  RC_ASSERT(px.has_value());
  RC_ASSERT(*px == *camera.project(cam_p));
  const auto f = [&](const Eigen::Vector3d& p) { return camera.project(p).value(); };
  const Matrix23 expected = testing::numeric_jacobian<2, 3>(f, cam_p, 1e-3 * cam_p.norm());
  RC_ASSERT((J - expected).norm() < 1e-8 * expected.norm());
}

RC_GTEST_PROP(CameraJacobian, AlongTheRayIsZero, ()) {
  const CameraModel camera = testing::any_camera();
  const double reach = std::min(camera.max_angle_rad(), std::atan(10.0));
  const Eigen::Vector3d cam_p = testing::direction(reach * testing::near_one());
  Matrix23 J;
  RC_ASSERT(camera.project(cam_p, &J).has_value());
  RC_ASSERT((J * cam_p).norm() < 1e-13 * (J.norm() + camera.width_px()));
}

TEST(CameraJacobian, IsSmoothOnTheAxis) {
  const auto fisheye = CameraModel::make(
      Equidistant{.fx = 190, .fy = 200, .cx = 320, .cy = 240, .k = {0.1, 0, 0, 0}}, 640, 480);
  const auto radtan = CameraModel::make(
      PinholeRadtan{.fx = 190, .fy = 200, .cx = 320, .cy = 240, .k = {0.1}, .coefficients = 4}, 640, 480);
  ASSERT_TRUE(fisheye && radtan);
  Matrix23 on_axis;
  on_axis << 95, 0, 0, 0, 100, 0;  // f / z
  for (const CameraModel& camera : {*fisheye, *radtan}) {
    for (const double r : {0.0, 1e-320, 1e-300, 1e-160, 1e-20, 1e-12}) {
      Matrix23 J;
      const auto px = camera.project({r, -r, 2}, &J);
      ASSERT_TRUE(px);
      EXPECT_LT((*px - Eigen::Vector2d(320, 240)).norm(), 1e-9) << r;
      EXPECT_LT((J - on_axis).norm(), 1e-9) << r;
      const auto bearing = camera.unproject({320 + r, 240 - r});
      ASSERT_TRUE(bearing);
      EXPECT_LT((*bearing - Eigen::Vector3d(r / 190, -r / 200, 1)).norm(), 1e-15) << r;
    }
  }
}

}  // namespace
}  // namespace waymark
