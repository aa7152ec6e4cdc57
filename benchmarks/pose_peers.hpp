#pragma once

// Pose of one tag by OpenCV and libapriltag, in our conventions.
#include <apriltag/apriltag_pose.h>

#include <cstdlib>
#include <memory>
#include <numbers>
#include <vector>

#include <Eigen/LU>
#include <opencv2/calib3d.hpp>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/pose/homography.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark::peers {

/// libapriltag's estimate_tag_pose: orthogonal iteration from the homography, 50 steps, then the second
/// minimum and 50 more.
class Libapriltag {
 public:
  /// The lens must have no distortion, which estimate_tag_pose does not support.
  Libapriltag(const PinholeRadtan& lens, const TagDetection& seen, double size_m)
      : H_(static_cast<matd_t*>(std::calloc(1, sizeof(matd_t) + 9 * sizeof(double))), std::free) {
    H_->nrows = H_->ncols = 3;
    const std::vector<Eigen::Vector2d> square = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    const Eigen::Matrix3d H = homography_dlt(square, seen.corners_px).value();
    for (int i = 0; i < 9; ++i) H_->data[i] = H(i / 3, i % 3) / H(2, 2);
    detection_.H = H_.get();
    for (int k = 0; k < 2; ++k) detection_.c[k] = H(k, 2) / H(2, 2);
    for (std::size_t i = 0; i < 4; ++i) {
      for (int k = 0; k < 2; ++k) detection_.p[3 - i][k] = seen.corners_px.at(i)[k];
    }
    info_ = {&detection_, size_m, lens.fx, lens.fy, lens.cx, lens.cy};
  }
  Libapriltag(const Libapriltag&) = delete;
  Libapriltag& operator=(const Libapriltag&) = delete;

  [[nodiscard]] SE3 pose() {
    info_.det = &detection_;
    apriltag_pose_t pose;
    estimate_tag_pose(&info_, &pose);
    const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(pose.R->data);
    const Eigen::Vector3d t = Eigen::Map<const Eigen::Vector3d>(pose.t->data);
    // matd_destroy only calls free, and Debian's library does not export it.
    std::free(pose.R);
    std::free(pose.t);
    return {SO3::from_quaternion(Eigen::Quaterniond(R)), t};
  }

 private:
  std::unique_ptr<matd_t, void (*)(void*)> H_;
  apriltag_detection_t detection_{};
  apriltag_detection_info_t info_{};
};

/// OpenCV's solvePnP with SOLVEPNP_IPPE_SQUARE, by the authors of IPPE: undistortion, closed form, the better
/// of the two.
class OpenCv {
 public:
  OpenCv(const PinholeRadtan& lens, const TagDetection& seen, double size_m)
      : K_(lens.fx, 0, lens.cx - 0.5, 0, lens.fy, lens.cy - 0.5, 0, 0, 1),
        k_(lens.k.begin(), lens.k.begin() + lens.coefficients) {
    // Their tag frame has y up and z towards the viewer.
    const double h = size_m / 2;
    corners_ = {{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
    for (const auto& p : seen.corners_px) px_.emplace_back(p.x() - 0.5, p.y() - 0.5);
  }

  /// The better one.
  [[nodiscard]] SE3 pose() const {
    cv::Vec3d r, t;
    cv::solvePnP(corners_, px_, K_, k_, r, t, false, cv::SOLVEPNP_IPPE_SQUARE);
    return ours(r, t);
  }
  /// Both, the better first.
  [[nodiscard]] std::vector<SE3> both() const {
    std::vector<cv::Vec3d> r, t;
    cv::solvePnPGeneric(corners_, px_, K_, k_, r, t, false, cv::SOLVEPNP_IPPE_SQUARE);
    std::vector<SE3> poses;
    for (std::size_t i = 0; i < r.size(); ++i) poses.push_back(ours(r[i], t[i]));
    return poses;
  }

 private:
  static SE3 ours(const cv::Vec3d& r, const cv::Vec3d& t) {
    static const SO3 turned = SO3::exp({std::numbers::pi, 0, 0});
    return {SO3::exp({r[0], r[1], r[2]}) * turned, Eigen::Vector3d(t[0], t[1], t[2])};
  }

  cv::Matx33d K_;
  std::vector<double> k_;
  std::vector<cv::Point3d> corners_;
  std::vector<cv::Point2d> px_;
};

}  // namespace waymark::peers
