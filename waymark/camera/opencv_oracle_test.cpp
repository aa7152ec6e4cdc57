#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <opencv2/calib3d.hpp>

#include "tests/support/random_camera.hpp"

namespace waymark {
namespace {

// In OpenCV, pixel centres are at integers, so its principal points and pixels are ours minus 1/2.
template <class Model>
cv::Matx33d opencv_matrix(const Model& camera) {
  return {camera.fx, 0, camera.cx - 0.5, 0, camera.fy, camera.cy - 0.5, 0, 0, 1};
}
Eigen::Vector2d from_opencv(const cv::Point2d& px) { return {px.x + 0.5, px.y + 0.5}; }
cv::Point2d to_opencv(const Eigen::Vector2d& px) { return {px.x() - 0.5, px.y() - 0.5}; }

Eigen::Vector2d opencv_project(const PinholeRadtan& camera, const Eigen::Vector3d& cam_p) {
  const std::vector<double> k(camera.k.begin(), camera.k.begin() + camera.coefficients);
  std::vector<cv::Point2d> px;
  cv::projectPoints(std::vector<cv::Point3d>{{cam_p.x(), cam_p.y(), cam_p.z()}}, cv::Vec3d(), cv::Vec3d(),
                    opencv_matrix(camera), k, px);
  return from_opencv(px.at(0));
}

Eigen::Vector2d opencv_project(const Equidistant& camera, const Eigen::Vector3d& cam_p) {
  std::vector<cv::Point2d> px;
  cv::fisheye::projectPoints(std::vector<cv::Point3d>{{cam_p.x(), cam_p.y(), cam_p.z()}}, px, cv::Vec3d(),
                             cv::Vec3d(), opencv_matrix(camera), cv::Vec4d(camera.k.data()));
  return from_opencv(px.at(0));
}

RC_GTEST_PROP(OpenCvOracle, BothModelsProjectAsOpenCvDoes, ()) {
  const CameraModel camera = testing::any_camera();
  const double reach = std::min(camera.max_angle_rad(), std::atan(3.0));
  const Eigen::Vector3d cam_p =
      testing::between(0.3, 5.0) * testing::direction(reach * testing::between(0, 0.99));
  const auto ours = camera.project(cam_p);
  RC_ASSERT(ours.has_value());
  const Eigen::Vector2d theirs =
      std::visit([&](const auto& model) { return opencv_project(model, cam_p); }, camera.projection());
  RC_ASSERT((*ours - theirs).norm() < 1e-10 * std::max(1.0, ours->norm()));
}

RC_GTEST_PROP(OpenCvOracle, NormalisesAsOpenCvDoesWhereItConverges, ()) {
  const CameraModel camera = testing::any_camera();
  RC_PRE(std::holds_alternative<PinholeRadtan>(camera.projection()));
  const auto& model = std::get<PinholeRadtan>(camera.projection());
  const Eigen::Vector2d px(testing::between(0, 640), testing::between(0, 480));
  const auto ours = camera.normalize(px);
  RC_PRE(ours.has_value());
  const std::vector<double> k(model.k.begin(), model.k.begin() + model.coefficients);
  std::vector<cv::Point2d> theirs;
  cv::undistortPoints(std::vector<cv::Point2d>{to_opencv(px)}, theirs, opencv_matrix(model), k, cv::noArray(),
                      cv::noArray(),
                      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 500, 1e-13));
  const Eigen::Vector2d found(theirs.at(0).x, theirs.at(0).y);
  // OpenCV's fixed-point iteration may stop early or converge elsewhere; if it has solved the equation, the
  // results agree.
  const auto back = camera.project({found.x(), found.y(), 1.0});
  const bool converged = back && (*back - px).norm() < 1e-9;
  RC_PRE(converged);
  RC_ASSERT((*ours - found).norm() < 1e-8);
}

TEST(OpenCvOracle, PixelCentresDifferByHalfAPixel) {
  const PinholeRadtan model{.fx = 100, .fy = 100, .cx = 10.5, .cy = 20.5};  // in OpenCV, these are 10 and 20
  const auto px = CameraModel::make(model, 21, 41)->project({0, 0, 1});
  ASSERT_TRUE(px);
  EXPECT_EQ(*px, Eigen::Vector2d(10.5, 20.5));
  std::vector<cv::Point2d> theirs;
  cv::projectPoints(std::vector<cv::Point3d>{{0, 0, 1}}, cv::Vec3d(), cv::Vec3d(),
                    cv::Matx33d(100, 0, 10, 0, 100, 20, 0, 0, 1), cv::noArray(), theirs);
  EXPECT_EQ(theirs.at(0), cv::Point2d(10, 20)) << "OpenCV's centres are at integers";
}

}  // namespace
}  // namespace waymark
