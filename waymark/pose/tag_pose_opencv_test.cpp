// OpenCV's IPPE_SQUARE, by the authors of the method, beside ours.
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "tests/support/geometry_matchers.hpp"
#include "tests/support/tag_views.hpp"
#include "waymark/pose/square_pose.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

using testing::kTagSize;
using testing::see_tag;
using testing::with_noise;

/// OpenCV wants the corners with y up and z towards the reader: our tag frame turned by pi about x.
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

// The closed form is the same: both rotations agree, for noisy corners too.
TEST(SquarePoseOracle, BothRotationsAreThoseOfOpenCv) {
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
  EXPECT_GT(better, 100) << "refinement is worth its time";
}

}  // namespace
}  // namespace waymark
