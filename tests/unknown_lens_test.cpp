// Corners of tags if the camera is not calibrated: the curvature of the edges suggests the distortion, which
// also displaces the bits inside. Uses the scene of the demo, with other seeds.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "waymark/simulation/render/photograph.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

/// Twelve tags of 16 cm, 0.9 to 3.5 m away, with tilts of up to 60 degrees.
PhotographScene dozen(Random& random) {
  PhotographScene scene;
  for (int i = 0; i < 12; ++i) {
    const double distance_m = 0.9 * std::pow(1.13, i);
    const int row = i / 4;
    const Eigen::Vector3d direction(-0.48 + 0.32 * (i % 4), -0.26 + 0.26 * row, 1);
    const SO3 cam_R_facing = SO3::from_rpy(-std::atan(direction.y()), std::atan(direction.x()), 0);
    const double yaw = random.uniform(-3, 3);
    const double pitch = random.uniform(-0.75, 0.75);
    const double roll = random.uniform(-0.75, 0.75);
    const SE3 cam_T_tag(cam_R_facing * SO3::from_rpy(roll, pitch, yaw), distance_m * direction);
    scene.tags.push_back({{FamilyId::Tag36h11, i}, cam_T_tag, 0.16});
  }
  return scene;
}

struct Errors {
  int tags = 0;
  int refined = 0;
  double nees = 0;
  double squares_px2 = 0;
  double outwards_px = 0;

  void add(const TagTruth& truth, const TagDetection& found) {
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& corner : truth.corners_px) middle += 0.25 * corner;
    Eigen::Matrix<double, 8, 1> error;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d off = found.corners_px[k] - truth.corners_px[k];
      error.segment<2>(2 * static_cast<Eigen::Index>(k)) = off;
      outwards_px += 0.25 * off.dot((truth.corners_px[k] - middle).normalized());
    }
    nees += error.dot(found.corner_covariance_px2->llt().solve(error)) / 8;
    squares_px2 += error.squaredNorm() / 8;
    ++refined;
  }
};

/// Whether the border of the image is farther away than a cell.
bool is_inside(const TagTruth& truth) {
  const double margin_px = truth.size_px / 8;
  return std::ranges::all_of(truth.corners_px, [&](const Eigen::Vector2d& corner) {
    return corner.x() > margin_px && corner.x() < 1280 - margin_px && corner.y() > margin_px &&
           corner.y() < 720 - margin_px;
  });
}

struct BySize {
  Errors large;  ///< sides of at least 140 px
  Errors small;
};

BySize errors_of(double k1, double k2) {
  const PinholeRadtan lens{
      .fx = 900, .fy = 900, .cx = 640, .cy = 360, .k = {k1, k2, 0, 0}, .coefficients = 4};
  const CameraModel camera = CameraModel::make(lens, 1280, 720).value();
  const TagFinder finder = make_tag_finder(DetectorOptions{}).value();
  BySize errors;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Random random(100 + seed);
    const PhotographScene scene = dozen(random);
    const Photograph photo =
        photograph(camera, scene, {.blur_sigma_px = 0.7, .read_noise_dn = 2}, random).value();
    const FoundTags found = find_tags(photo.image, finder, ImageLens::unknown()).value();
    for (const TagTruth& truth : photo.tags) {
      if (!is_inside(truth)) continue;
      Errors& of_size = truth.size_px < 140 ? errors.small : errors.large;
      ++of_size.tags;
      for (std::size_t i = 0; i < found.detections.size(); ++i)
        if (found.detections[i].tag == truth.tag && found.refinements[i] == RefinementOutcome::Refined)
          of_size.add(truth, found.detections[i]);
    }
  }
  return errors;
}

void expect_right(const Errors& errors) {
  std::printf("%d tags, %d refined, RMSE %.3f px, outwards %+.3f px, NEES/8 %.2f\n", errors.tags,
              errors.refined, std::sqrt(errors.squares_px2 / errors.refined),
              errors.outwards_px / errors.refined, errors.nees / errors.refined);
  EXPECT_GE(errors.tags, 6);
  EXPECT_GE(errors.refined, 0.98 * errors.tags);
  EXPECT_LT(std::sqrt(errors.squares_px2 / errors.refined), 0.03);
  EXPECT_LT(std::abs(errors.outwards_px / errors.refined), 0.01);
  EXPECT_GT(errors.nees / errors.refined, 0.5);
  EXPECT_LT(errors.nees / errors.refined, 1.5);
}

TEST(UnknownLens, CornersAreConsistentWhateverTheDistortion) {
  for (const double k1 : {-0.12, 0.1}) {
    std::printf("k1 %.2f\n", k1);
    const BySize errors = errors_of(k1, k1 < 0 ? 0.02 : 0);
    expect_right(errors.small);
    expect_right(errors.large);
  }
}

}  // namespace
}  // namespace waymark
