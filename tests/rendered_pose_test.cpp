// From pixels to the pose of a tag: simulated photographs, detector, refined corners with covariance, pose
// with covariance. The normalised squared error must match six degrees of freedom.
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "waymark/geometry/lie.hpp"
#include "waymark/pose/tag_pose.hpp"
#include "waymark/simulation/render/photograph.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

constexpr double kTagSizeM = 0.15;
constexpr double kFocalPx = 900;

CameraModel camera() {
  return CameraModel::make(PinholeRadtan{.fx = kFocalPx, .fy = kFocalPx, .cx = 640, .cy = 360}, 1280, 720)
      .value();
}

/// Tags of one size on a grid, tilted between 20 and 70 degrees about any axis, at any roll.
PhotographScene scene_of(double size_px, Random& random) {
  PhotographScene scene;
  const int columns = size_px > 100 ? 4 : 8;
  const int rows = size_px > 100 ? 2 : 4;
  int number = 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double depth_m = kFocalPx * kTagSizeM / size_px;
      const Eigen::Vector2d px(1280.0 / columns * (column + 0.5 + random.uniform(-0.05, 0.05)),
                               720.0 / rows * (row + 0.5 + random.uniform(-0.05, 0.05)));
      const double about = random.uniform(0, 2 * std::numbers::pi);
      const double tilt = random.uniform(20, 70) * std::numbers::pi / 180;
      const SO3 turn = SO3::exp({tilt * std::cos(about), tilt * std::sin(about), 0}) *
                       SO3::exp({0, 0, random.uniform(0, 2 * std::numbers::pi)});
      const Eigen::Vector3d ray((px.x() - 640) / kFocalPx, (px.y() - 360) / kFocalPx, 1);
      scene.tags.push_back({{FamilyId::Tag36h11, number++}, SE3(turn, ray * depth_m), kTagSizeM});
    }
  }
  return scene;
}

double squared_error(const TagPoseSolution& found, const SE3& truth) {
  const SE3::Tangent error = minus(truth, found.cam_T_tag);
  return error.dot(Eigen::LLT<PoseCovariance>(found.covariance).solve(error));
}

double angle(const SE3& a, const SE3& b) { return (a.rotation().inverse() * b.rotation()).angle(); }

struct Nees {
  double sum = 0;
  double worst = 0;
  int tags = 0;
};

/// For the solution nearest to the truth, over `images` photographs of tags of one size.
Nees nees_at(double size_px, int images) {
  const CameraModel model = camera();
  RefinementOptions straight;
  straight.curvature_per_px = 0;  // the lens has no distortion
  const TagFinder finder = make_tag_finder(DetectorOptions{}, straight).value();
  Random random(static_cast<std::uint64_t>(size_px));
  Nees nees;
  for (int i = 0; i < images; ++i) {
    const PhotographScene scene = scene_of(size_px, random);
    const auto photo = photograph(model, scene, {}, random).value();
    const std::vector<TagDetection> found =
        find_tags(photo.image, finder, ImageLens::unknown()).value().detections;
    for (const TagDetection& seen : found) {
      const auto pose = estimate_tag_pose(seen, kTagSizeM, model);
      if (!pose || seen.tag.number >= static_cast<int>(scene.tags.size())) continue;
      const SE3& truth = scene.tags[static_cast<std::size_t>(seen.tag.number)].cam_T_tag;
      const bool other =
          pose->other && angle(pose->other->cam_T_tag, truth) < angle(pose->best.cam_T_tag, truth);
      const double error = squared_error(other ? *pose->other : pose->best, truth);
      nees.sum += error;
      nees.worst = std::max(nees.worst, error);
      ++nees.tags;
    }
  }
  return nees;
}

TEST(PoseFromPhotographs, HasAConsistentCovariance) {
  const int images = std::getenv("WAYMARK_FULL") != nullptr ? 40 : 2;
  for (const double size_px : {24.0, 34.0, 48.0, 68.0, 96.0, 140.0, 200.0}) {
    const Nees nees = nees_at(size_px, images);
    std::printf("%3.0f px: %4d tags, NEES mean %.2f of 6, worst %.0f\n", size_px, nees.tags,
                nees.sum / nees.tags, nees.worst);
    EXPECT_GT(nees.tags, 6 * images) << size_px;
    EXPECT_GT(nees.sum / nees.tags, 4) << size_px;
    EXPECT_LT(nees.sum / nees.tags, 9) << size_px;
  }
}

}  // namespace
}  // namespace waymark
