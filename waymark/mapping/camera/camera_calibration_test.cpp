#include "waymark/mapping/camera/camera_calibration.hpp"

#include <cmath>
#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "waymark/base/angles.hpp"
#include "waymark/base/random.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;

/// A board of 6 x 5 tags of 4 cm with a pitch of 5.2 cm, x right and y down, centred at the origin.
TagMap board() {
  TagMap map;
  for (int row = 0; row < 5; ++row)
    for (int column = 0; column < 6; ++column) {
      MappedTag tag{.map_T_tag = SE3(SO3(), {0.052 * (column - 2.5), 0.052 * (row - 2.0), 0}),
                    .size_m = 0.04};
      map.tags.emplace(TagId{FamilyId::Tag36h11, 6 * row + column}, tag);
    }
  return map;
}

/// Images from all sides with corner noise; tags that are not entirely in the image are not detected.
std::vector<std::vector<TagDetection>> images(const CameraModel& camera, Random& random, double sigma_px,
                                              int count, double max_tilt_deg) {
  std::vector<std::vector<TagDetection>> all;
  for (int i = 0; i < count; ++i) {
    const SO3 tilt = SO3::exp({to_radians(max_tilt_deg) * random.uniform(-1, 1),
                               to_radians(max_tilt_deg) * random.uniform(-1, 1), random.uniform(-0.5, 0.5)});
    const double depth = random.uniform(0.25, 0.6);
    const SE3 cam_T_board(tilt,
                          {depth * random.uniform(-0.4, 0.4), depth * random.uniform(-0.3, 0.3), depth});
    std::vector<TagDetection> seen;
    for (const auto& [id, tag] : board().tags) {
      TagDetection detection{.tag = id};
      bool whole = true;
      const auto corners = tag_corners(tag.size_m);
      for (std::size_t k = 0; k < 4; ++k) {
        const auto px = camera.project(cam_T_board * (tag.map_T_tag * corners[k]));
        whole = whole && px && camera.contains(*px);
        if (px) detection.corners_px[k] = *px + sigma_px * Eigen::Vector2d(random.normal(), random.normal());
      }
      detection.corner_covariance_px2 = CornerCovariance::Identity() * sigma_px * sigma_px;
      if (whole) seen.push_back(detection);
    }
    all.push_back(std::move(seen));
  }
  return all;
}

CameraModel webcam() {
  return CameraModel::make(PinholeRadtan{.fx = 512,
                                         .fy = 509,
                                         .cx = 326,
                                         .cy = 236,
                                         .k = {-0.28, 0.09, 0.001, -0.0005},
                                         .coefficients = 4},
                           kWidth, kHeight)
      .value();
}

CameraModel fisheye() {
  return CameraModel::make(
             Equidistant{.fx = 190, .fy = 191, .cx = 318, .cy = 243, .k = {-0.02, 0.01, -0.004, 0.0}}, kWidth,
             kHeight)
      .value();
}

Eigen::VectorXd truth_of(const CameraModel& camera, LensModel lens) {
  Eigen::VectorXd p = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameter_names(lens).size()));
  std::visit(
      [&](const auto& model) {
        p.head<4>() << model.fx, model.fy, model.cx, model.cy;
        for (Eigen::Index i = 4; i < p.size(); ++i) p[i] = model.k[static_cast<std::size_t>(i - 4)];
      },
      camera.projection());
  return p;
}

/// Mean NEES of all parameters over seeds; it equals the number of parameters if the covariance is
/// consistent.
double mean_nees(const CameraModel& camera, LensModel lens, int seeds) {
  double sum = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    Random random(static_cast<std::uint64_t>(seed));
    const auto found = calibrate_camera(images(camera, random, 0.1, 10, 40), board(), kWidth, kHeight, lens);
    EXPECT_TRUE(found) << seed << ": " << to_string(found.error());
    if (!found) return 0;
    const Eigen::VectorXd error = found->parameters - truth_of(camera, lens);
    sum += error.dot(found->covariance.ldlt().solve(error));
  }
  return sum / seeds;
}

TEST(CameraCalibration, EstimatesLensesWithConsistentCovariance) {
  const int seeds = std::getenv("WAYMARK_FULL") != nullptr ? 100 : 5;
  for (const auto& [camera, lens] :
       {std::pair(webcam(), LensModel::Radtan4), std::pair(fisheye(), LensModel::Equidistant)}) {
    constexpr double kParameters = 8;
    const double sigma = std::sqrt(2 * kParameters / seeds);
    EXPECT_NEAR(mean_nees(camera, lens, seeds), kParameters, 3.5 * sigma) << to_string(lens);
  }
}

TEST(CameraCalibration, SelectsTheLensByCrossValidation) {
  Random random(3);
  const auto found =
      calibrate_camera(images(webcam(), random, 0.1, 15, 40), board(), kWidth, kHeight).value();
  EXPECT_EQ(found.lens, LensModel::Radtan4);
  EXPECT_NEAR(found.held_out_rms_px, 0.1 * std::sqrt(2), 0.01);
  EXPECT_NEAR(found.noise_scale, 1, 0.05);
  EXPECT_LT(found.rms_px, found.held_out_rms_px);
  // The error with no distortion at all.
  EXPECT_GT(*found.trials.front().held_out_rms_px, 3 * found.held_out_rms_px);
  EXPECT_TRUE(found.advice.empty()) << found.advice.front();
}

TEST(CameraCalibration, SelectsAmongTheGivenLenses) {
  Random random(3);
  const auto seen = images(fisheye(), random, 0.1, 15, 40);
  const auto any = calibrate_camera(seen, board(), kWidth, kHeight).value();
  EXPECT_EQ(any.lens, LensModel::Equidistant);
  EXPECT_EQ(any.trials.size(), lens_models().size());
  CameraCalibrationOptions options;
  options.lenses = {LensModel::Radtan4, LensModel::Rational8};
  const auto some = calibrate_camera(seen, board(), kWidth, kHeight, {}, options).value();
  EXPECT_NE(some.lens, LensModel::Equidistant);
  ASSERT_EQ(some.trials.size(), 2U);
  EXPECT_EQ(some.trials.front().lens, LensModel::Radtan4);
  EXPECT_GT(some.held_out_rms_px, any.held_out_rms_px);
}

TEST(CameraCalibration, StopsWithinAnIterationOnRequest) {
  Random random(3);
  constexpr int kLast = 20;
  int calls = 0;
  CameraCalibrationOptions options;
  options.goes_on = [&calls] { return ++calls < kLast; };
  EXPECT_FALSE(
      calibrate_camera(images(webcam(), random, 0.1, 15, 40), board(), kWidth, kHeight, {}, options));
  EXPECT_LT(calls, kLast + 40) << "no other fit is begun";
}

TEST(CameraCalibration, ExcludesTagsWithSwappedIds) {
  Random random(4);
  auto views = images(webcam(), random, 0.1, 12, 40);
  std::swap(views[2][3].tag, views[2][4].tag);
  for (Eigen::Vector2d& corner : views[5][0].corners_px) corner += Eigen::Vector2d(3, -2);
  const auto found = calibrate_camera(views, board(), kWidth, kHeight, LensModel::Radtan4).value();
  EXPECT_EQ(found.views[2].rejected, 2U);
  EXPECT_EQ(found.views[5].rejected, 1U);
  EXPECT_NEAR(found.parameters[0], 512, 4 * std::sqrt(found.covariance(0, 0)));
  EXPECT_LT(found.rms_px, 0.15);
}

TEST(CameraCalibration, AdvisesOnMissingImages) {
  Random random(5);
  const auto straight =
      CameraModel::make(PinholeRadtan{.fx = 512, .fy = 509, .cx = 326, .cy = 236}, kWidth, kHeight);
  const auto frontal =
      calibrate_camera(images(*straight, random, 0.1, 6, 3), board(), kWidth, kHeight, LensModel::None);
  ASSERT_TRUE(frontal) << to_string(frontal.error());
  EXPECT_THAT(frontal->advice, testing::Contains(testing::HasSubstr("6 usable")));
  EXPECT_THAT(frontal->advice, testing::Contains(testing::HasSubstr("20 degrees")));
  auto left = images(webcam(), random, 0.1, 12, 40);
  for (auto& view : left)
    std::erase_if(view, [](const TagDetection& d) { return d.corners_px[1].x() > 0.6 * kWidth; });
  const auto one_sided = calibrate_camera(left, board(), kWidth, kHeight, LensModel::Radtan4);
  ASSERT_TRUE(one_sided) << to_string(one_sided.error());
  EXPECT_THAT(one_sided->advice, testing::Contains(testing::HasSubstr("top right, right, bottom right")));
}

TEST(CameraCalibration, UndeterminedCoefficientsHaveAPositiveVariance) {
  const auto mild = CameraModel::make(
      PinholeRadtan{.fx = 505, .fy = 502, .cx = 322, .cy = 238, .k = {-0.12}, .coefficients = 4}, kWidth,
      kHeight);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Random random(seed);
    const auto found =
        calibrate_camera(images(*mild, random, 0.05, 8, 15), board(), kWidth, kHeight, LensModel::Rational8);
    if (!found) continue;  // an error is a valid result as well
    EXPECT_GT(found->covariance.diagonal().minCoeff(), 0) << "seed " << seed;
    EXPECT_GT(found->covariance.ldlt().vectorD().minCoeff(), 0) << "seed " << seed;
  }
}

TEST(CameraCalibration, RejectsUninformativeInput) {
  Random random(6);
  const auto views = images(webcam(), random, 0.1, 12, 40);
  EXPECT_FALSE(calibrate_camera({}, board(), kWidth, kHeight));
  EXPECT_FALSE(calibrate_camera({views[0], views[1]}, board(), kWidth, kHeight));
  EXPECT_FALSE(calibrate_camera(views, {}, kWidth, kHeight));
  auto broken = views;
  broken[0][0].corners_px[2].x() = std::nan("");
  EXPECT_FALSE(calibrate_camera(broken, board(), kWidth, kHeight));
  std::vector<TargetMarks> points;  // all marks are at one point, so that poses are not determined
  for (const auto& view : views) {
    points.push_back(target_marks(view, board()));
    for (TargetMark& mark : points.back()) {
      mark.target_points_m.assign(4, {0.01, 0, 0});
      mark.seen_px.assign(4, {300, 200});
    }
  }
  EXPECT_FALSE(calibrate_camera(points, kWidth, kHeight));
  auto mixed = views;  // tag numbers that are unrelated to the positions
  for (auto& view : mixed)
    for (std::size_t i = 0; i < view.size(); ++i) view[i].tag.number = static_cast<int>((7 * i + 3) % 30);
  const auto found = calibrate_camera(mixed, board(), kWidth, kHeight, LensModel::Radtan4);
  if (found) {
    EXPECT_FALSE(found->advice.empty());
  }
}

}  // namespace
}  // namespace waymark
