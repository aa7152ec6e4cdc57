// Poses of tags with a camera that was calibrated by images: the standard deviations must include the errors
// of the calibration. Each seed makes its own calibration and its own images of tags.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "waymark/camera/intrinsics.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/camera/camera_calibration.hpp"
#include "waymark/pose/tag_pose.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/render/photograph.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

constexpr int kLensColumns = 6;
constexpr int kLensRows = 5;
constexpr double kBoardTagM = 0.03;
constexpr double kBoardPitchM = 0.039;
constexpr double kPosedTagM = 0.16;
constexpr int kBoardViews = 8;

CameraModel true_camera() {
  const PinholeRadtan lens{.fx = 612.4,
                           .fy = 611.1,
                           .cx = 325.7,
                           .cy = 236.2,
                           .k = {-0.24, 0.07, 0.0006, -0.0004},
                           .coefficients = 4};
  return CameraModel::make(lens, 640, 480).value();
}

TagMap lens_board() {
  TagMap board;
  for (int i = 0; i < kLensColumns * kLensRows; ++i) {
    const double x_m = kBoardPitchM * (i % kLensColumns - 0.5 * (kLensColumns - 1));
    const int row = i / kLensColumns;
    const double y_m = kBoardPitchM * (row - 0.5 * (kLensRows - 1));
    board.tags.emplace(TagId{FamilyId::Tag36h11, i},
                       MappedTag{.map_T_tag = SE3(SO3(), {x_m, y_m, 0}), .size_m = kBoardTagM});
  }
  return board;
}

/// Board poses: tilted in all directions, in all parts of the image.
SE3 cam_T_lens_board(int view, Random& random) {
  const double about = 2 * std::numbers::pi * view * 3 / kBoardViews;
  const double tilt_rad = view % 4 == 0 ? 0.05 : 0.55;
  const double away_m = random.uniform(0.3, 0.45);
  const SO3 tilted =
      SO3::exp({tilt_rad * std::cos(about), tilt_rad * std::sin(about), random.uniform(-0.3, 0.3)});
  return {tilted, {0.16 * away_m * std::cos(1.7 * view), 0.12 * away_m * std::sin(1.7 * view), away_m}};
}

/// Distances of the tags whose poses are estimated.
struct Distances {
  double min_m = 1.1;
  double max_m = 2.2;
};

/// A tag at the left, in the middle or at the right.
SE3 cam_T_posed_tag(int place, const Distances& distances, Random& random) {
  const double away_m = random.uniform(distances.min_m, distances.max_m);
  const SO3 turn =
      SO3::from_rpy(random.uniform(-0.3, 0.3), random.uniform(-0.8, 0.8), random.uniform(-0.2, 0.2));
  return {turn, {0.3 * (place - 1) * away_m, random.uniform(-0.15, 0.15) * away_m, away_m}};
}

/// Squared errors of poses relative to their variances.
struct PoseErrors {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< sum over tags, per axis
  double nees = 0;                                     ///< sum over tags; 6 is consistent
  int scaled = 0;                                      ///< number of tags with sigma_scale above 1
  int tags = 0;

  void add(const TagPose& pose, const SE3& truth) {
    const auto away = [&](const TagPoseSolution& one) {
      return (one.cam_T_tag.rotation().inverse() * truth.rotation()).angle();
    };
    const bool second = pose.other && away(*pose.other) < away(pose.best);
    const TagPoseSolution& found = second ? *pose.other : pose.best;
    const PoseDeviations sigma = standard_deviations(found.cam_T_tag, found.covariance);
    position +=
        (found.cam_T_tag.translation() - truth.translation()).cwiseQuotient(sigma.position_m).cwiseAbs2();
    const SE3::Tangent error = minus(truth, found.cam_T_tag);
    nees += error.dot(Eigen::LLT<PoseCovariance>(found.covariance).solve(error));
    scaled += found.sigma_scale > 1 ? 1 : 0;
    ++tags;
  }
  void print(const char* name) const {
    std::printf("%-28s %4d tags, mean (error/sigma)^2 x %.2f y %.2f z %.2f, NEES %.2f of 6, %d scaled\n",
                name, tags, position.x() / tags, position.y() / tags, position.z() / tags, nees / tags,
                scaled);
  }
  void expect_between(double low, double high) const {
    ASSERT_GT(tags, 0);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_GT(position[axis] / tags, low) << "axis " << axis;
      EXPECT_LT(position[axis] / tags, high) << "axis " << axis;
    }
  }
};

/// The covariance of a calibration as it is used: with correlations, or only with standard deviations.
IntrinsicsCovariance covariance_of(const CameraCalibration& calibration, bool correlated) {
  if (correlated) return calibration.covariance;
  return IntrinsicsCovariance(calibration.covariance.diagonal().asDiagonal());
}

/// The errors with the true camera, and with the estimated one: taken as exact, with standard deviations
/// only, with the full covariance.
struct LensCases {
  PoseErrors true_lens{};
  PoseErrors taken_as_exact{};
  PoseErrors diagonal{};
  PoseErrors full{};
  double lens_nees = 0;
  Eigen::Index parameters = 0;
  int seeds = 0;

  void add(const TagDetection& seen, const SE3& truth, const CameraCalibration& found) {
    const auto pose = [&](const CameraModel& camera, const IntrinsicsCovariance& lens) {
      TagPoseOptions options;
      options.intrinsics_covariance = lens;
      return estimate_tag_pose(seen, kPosedTagM, camera, options).value();
    };
    true_lens.add(pose(true_camera(), {}), truth);
    taken_as_exact.add(pose(found.camera, {}), truth);
    diagonal.add(pose(found.camera, covariance_of(found, false)), truth);
    full.add(pose(found.camera, covariance_of(found, true)), truth);
  }
  void add(const CameraCalibration& found) {
    const Eigen::VectorXd truth = intrinsics_of(true_camera());
    Eigen::VectorXd error = found.parameters;  // further coefficients are zero
    error.head(truth.size()) -= truth;
    parameters = error.size();
    lens_nees += error.dot(found.covariance.llt().solve(error));
    ++seeds;
  }
  void print() const {
    std::printf("%d calibrations, NEES of the lens %.2f of %d\n", seeds, lens_nees / seeds,
                static_cast<int>(parameters));
    true_lens.print("true lens");
    taken_as_exact.print("calibrated, taken as exact");
    diagonal.print("calibrated, sigmas only");
    full.print("calibrated, full covariance");
  }
};

void add_noise(double sigma_px, Random& random, TagDetection& seen) {
  for (Eigen::Vector2d& corner : seen.corners_px)
    corner += sigma_px * Eigen::Vector2d(random.normal(), random.normal());
  seen.corner_covariance_px2 = sigma_px * sigma_px * CornerCovariance::Identity();
}

std::optional<TagDetection> noisy_view(TagId tag, const SE3& cam_T_tag, double size_m, double sigma_px,
                                       Random& random) {
  const auto corners = visible_corners(true_camera(), cam_T_tag, size_m);
  if (!corners) return std::nullopt;
  TagDetection seen{.tag = tag};
  seen.corners_px = *corners;
  add_noise(sigma_px, random, seen);
  return seen;
}

/// Calibrations and tags with known corner noise.
struct NoisyCase {
  LensModel lens = LensModel::Radtan4;
  double board_sigma_px = 0.05;
  Distances distances{};
};

std::vector<std::vector<TagDetection>> noisy_board_images(const TagMap& board, double sigma_px,
                                                          Random& random) {
  std::vector<std::vector<TagDetection>> images(kBoardViews);
  for (std::size_t view = 0; view < images.size(); ++view) {
    const SE3 cam_T_board = cam_T_lens_board(static_cast<int>(view), random);
    for (const auto& [tag, mapped] : board.tags)
      if (auto seen = noisy_view(tag, cam_T_board * mapped.map_T_tag, mapped.size_m, sigma_px, random))
        images[view].push_back(*std::move(seen));
  }
  return images;
}

/// Returns whether the images determine the lens.
bool add_noisy_seed(std::uint64_t seed, const NoisyCase& noisy, LensCases& cases) {
  constexpr double kTagSigmaPx = 0.05;
  Random random(seed);
  const TagMap board = lens_board();
  const auto images = noisy_board_images(board, noisy.board_sigma_px, random);
  const auto found = calibrate_camera(images, board, 640, 480, noisy.lens);
  if (!found) return false;
  cases.add(*found);
  for (int i = 0; i < 18; ++i) {
    const SE3 truth = cam_T_posed_tag(i % 3, noisy.distances, random);
    const auto seen = noisy_view({FamilyId::Tag36h11, i}, truth, kPosedTagM, kTagSigmaPx, random);
    if (seen) cases.add(*seen, truth, *found);
  }
  return true;
}

bool full_run() { return std::getenv("WAYMARK_FULL") != nullptr; }

TEST(LensUncertainty, PosesFromNoisyCornersAreConsistent) {
  const std::uint64_t seeds = full_run() ? 100 : 8;
  for (const double board_sigma_px : {0.05, 0.5}) {
    LensCases cases;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed)
      ASSERT_TRUE(add_noisy_seed(seed, {.board_sigma_px = board_sigma_px}, cases)) << seed;
    cases.print();
    cases.true_lens.expect_between(0.8, 1.25);
    cases.full.expect_between(full_run() ? 0.7 : 0.3, full_run() ? 1.4 : 2.3);
    EXPECT_NEAR(cases.full.nees / cases.full.tags, 6, 1.2);
    EXPECT_GT(cases.taken_as_exact.position.maxCoeff() / cases.taken_as_exact.tags, 4)
        << "the error of the lens must matter in this test";
  }
}

/// Near tags fill a third of the image, so an error of the lens leaves residuals.
TEST(LensUncertainty, ResidualsFromTheLensDoNotScaleTheCovariance) {
  LensCases cases;
  for (std::uint64_t seed = 1; seed <= 6; ++seed)
    ASSERT_TRUE(add_noisy_seed(seed, {.board_sigma_px = 1.5, .distances = {0.45, 0.7}}, cases)) << seed;
  cases.print();
  EXPECT_GT(cases.taken_as_exact.scaled, cases.full.tags / 10);
  EXPECT_LT(cases.full.scaled, cases.full.tags / 30);
}

/// The coefficients of this lens compensate each other. Without their correlations, the standard deviations
/// are much too large.
TEST(LensUncertainty, CorrelationsMatterForALensWithManyParameters) {
  LensCases cases;
  int calibrated = 0;
  const std::uint64_t seeds = full_run() ? 20 : 1;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed)
    calibrated += add_noisy_seed(seed, {.lens = LensModel::Rational8}, cases) ? 1 : 0;
  ASSERT_GT(calibrated, 0);
  cases.print();
  EXPECT_LT(cases.diagonal.position.z(), 0.2 * cases.diagonal.tags);
  EXPECT_GT(cases.full.position.z(), 0.6 * cases.full.tags);
  EXPECT_LT(cases.full.position.z(), 1.4 * cases.full.tags);
}

std::vector<TagDetection> photographed(const PhotographScene& scene, const TagFinder& finder, ImageLens lens,
                                       Random& random) {
  const Photograph photo = photograph(true_camera(), scene, {}, random).value();
  return find_tags(photo.image, finder, lens).value().detections;
}

void add_photographed_seed(std::uint64_t seed, const TagFinder& finder, LensCases& cases) {
  Random random(seed);
  const TagMap board = lens_board();
  std::vector<std::vector<TagDetection>> images;
  for (int view = 0; view < kBoardViews; ++view) {
    const SE3 cam_T_board = cam_T_lens_board(view, random);
    PhotographScene scene;
    for (const auto& [tag, mapped] : board.tags)
      scene.tags.push_back({tag, cam_T_board * mapped.map_T_tag, mapped.size_m, 0.3});
    images.push_back(photographed(scene, finder, ImageLens::unknown(), random));
  }
  const auto found = calibrate_camera(images, board, 640, 480, LensModel::Radtan4);
  ASSERT_TRUE(found) << to_string(found.error());
  cases.add(*found);
  for (int image = 0; image < 3; ++image) {
    PhotographScene scene;
    for (int place = 0; place < 3; ++place)
      scene.tags.push_back(
          {{FamilyId::Tag36h11, 3 * image + place}, cam_T_posed_tag(place, {}, random), kPosedTagM});
    for (const TagDetection& seen : photographed(scene, finder, ImageLens::of(found->camera), random)) {
      const int place = seen.tag.number - 3 * image;
      if (place >= 0 && place < 3)
        cases.add(seen, scene.tags[static_cast<std::size_t>(place)].cam_T_tag, *found);
    }
  }
}

TEST(LensUncertainty, PosesFromPhotographsAreConsistent) {
  const std::uint64_t seeds = full_run() ? 40 : 6;
  const TagFinder finder = make_tag_finder().value();
  LensCases cases;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) add_photographed_seed(seed, finder, cases);
  cases.print();
  cases.true_lens.expect_between(0.5, 1.35);  // the corner covariances are slightly too large
  cases.full.expect_between(0.3, 2.3);
  EXPECT_GT(cases.taken_as_exact.position.maxCoeff() / cases.taken_as_exact.tags, 4)
      << "the error of the lens must matter in this test";
}

}  // namespace
}  // namespace waymark
