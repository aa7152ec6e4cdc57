// Tests the error of a calibration and the consistency of its covariance, and compares it with OpenCV on the
// same corners. The target is a chessboard of 7 x 5 corners in 20 views of 1280 x 720 px, with 0.1 px of
// corner noise. With WAYMARK_FULL, there are 50 runs.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <opencv2/calib3d.hpp>

#include "waymark/base/order_statistics.hpp"
#include "waymark/base/random.hpp"
#include "waymark/mapping/camera/camera_calibration.hpp"

namespace waymark {
namespace {

constexpr int kWidth = 1280;
constexpr int kHeight = 720;
constexpr double kNoisePx = 0.1;
constexpr int kViews = 20;

const CalibrationBoard& board() {
  static const CalibrationBoard known{.kind = BoardKind::Chessboard, .columns = 8, .rows = 6, .size_m = 0.03};
  return known;
}

struct Lens {
  const char* name;
  LensModel model;
  CameraModel::Projection truth;
};

std::vector<Lens> lenses() {
  return {{"none", LensModel::None, PinholeRadtan{.fx = 950, .fy = 947, .cx = 652, .cy = 349}},
          {"radtan5", LensModel::Radtan5,
           PinholeRadtan{.fx = 950,
                         .fy = 947,
                         .cx = 652,
                         .cy = 349,
                         .k = {-0.21, 0.08, 6e-4, -4e-4, -0.012},
                         .coefficients = 5}},
          {"equidistant", LensModel::Equidistant,
           Equidistant{.fx = 420, .fy = 421, .cx = 646, .cy = 355, .k = {-0.02, 0.006, -0.003, 0.0005}}}};
}

/// All 35 corners from twenty directions, close enough to fill a good part of the image.
std::vector<TargetMarks> images(const CameraModel& camera, double focal_px, Random& random) {
  const auto places = board_corners(board());
  std::vector<TargetMarks> all;
  while (all.size() < kViews) {
    const double about = 2 * std::numbers::pi * static_cast<double>(all.size()) / kViews;
    const double tilt = random.uniform(0.3, 0.75);
    const SO3 turn =
        SO3::exp(Eigen::Vector3d(tilt * std::cos(about), tilt * std::sin(about), random.uniform(-0.6, 0.6)));
    const double depth = focal_px * 0.21 / (kWidth * random.uniform(0.3, 0.6));
    const SE3 cam_T_board(turn,
                          {depth * random.uniform(-0.45, 0.45) * kWidth / (2 * focal_px) * 1.6,
                           depth * random.uniform(-0.45, 0.45) * kHeight / (2 * focal_px) * 1.6, depth});
    std::vector<BoardCorner> corners;
    for (std::size_t k = 0; k < places.size(); ++k) {
      const auto px = camera.project(cam_T_board * Eigen::Vector3d(places[k].x(), places[k].y(), 0));
      if (px && camera.contains(*px))
        corners.push_back(
            {static_cast<int>(k), *px + kNoisePx * Eigen::Vector2d(random.normal(), random.normal())});
    }
    if (corners.size() == places.size()) all.push_back(target_marks(corners, places));
  }
  return all;
}

Eigen::VectorXd parameters_of(const CameraModel::Projection& projection, LensModel lens) {
  Eigen::VectorXd p = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameter_names(lens).size()));
  std::visit(
      [&](const auto& model) {
        p.head<4>() << model.fx, model.fy, model.cx, model.cy;
        for (Eigen::Index i = 4; i < p.size(); ++i) p[i] = model.k.at(static_cast<std::size_t>(i - 4));
      },
      projection);
  return p;
}

/// fx estimated by OpenCV from the same corners.
double opencv_focal_px(const std::vector<TargetMarks>& views, LensModel lens) {
  std::vector<std::vector<cv::Point3f>> places;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const TargetMarks& view : views) {
    auto& of_places = places.emplace_back();
    auto& of_pixels = pixels.emplace_back();
    for (const TargetMark& mark : view) {
      const Eigen::Vector3f p = mark.target_points_m[0].cast<float>();
      of_places.emplace_back(p.x(), p.y(), p.z());
      of_pixels.emplace_back(static_cast<float>(mark.seen_px[0].x() - 0.5),
                             static_cast<float>(mark.seen_px[0].y() - 0.5));
    }
  }
  cv::Mat K;
  cv::Mat distortion;
  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  if (lens == LensModel::Equidistant) {
    // OpenCV diverges from its default starting values in some of these cases, so it starts near the truth.
    K = (cv::Mat_<double>(3, 3) << 430, 0, 640, 0, 430, 360, 0, 0, 1);
    distortion = cv::Mat::zeros(4, 1, CV_64F);
    cv::fisheye::calibrate(places, pixels, {kWidth, kHeight}, K, distortion, rotations, translations,
                           cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW |
                               cv::fisheye::CALIB_USE_INTRINSIC_GUESS,
                           {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-10});
  } else {
    const int none = cv::CALIB_FIX_K1 | cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3 | cv::CALIB_ZERO_TANGENT_DIST;
    cv::calibrateCamera(places, pixels, {kWidth, kHeight}, K, distortion, rotations, translations,
                        lens == LensModel::None ? none : 0,
                        {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-12});
  }
  return K.at<double>(0, 0);
}

TEST(CalibrationAccuracy, FocalLengthErrorIsBelow0_05PercentAndCovarianceIsConsistent) {
  const int runs = std::getenv("WAYMARK_FULL") != nullptr ? 50 : 4;
  for (const Lens& lens : lenses()) {
    const CameraModel camera = CameraModel::make(lens.truth, kWidth, kHeight).value();
    const Eigen::VectorXd truth = parameters_of(lens.truth, lens.model);
    std::vector<double> ours;
    std::vector<double> theirs;
    double nees = 0;
    for (int run = 0; run < runs; ++run) {
      Random random(static_cast<std::uint64_t>(1000 + run));
      const auto views = images(camera, truth[0], random);
      const auto found = calibrate_camera(views, kWidth, kHeight, lens.model);
      ASSERT_TRUE(found) << lens.name << " run " << run << ": " << to_string(found.error());
      const Eigen::VectorXd error = found->parameters - truth;
      nees += error.dot(found->covariance.ldlt().solve(error)) / runs;
      ours.push_back(std::abs(error[0]) / truth[0]);
      theirs.push_back(std::abs(opencv_focal_px(views, lens.model) - truth[0]) / truth[0]);
    }
    const auto numbers = static_cast<double>(truth.size());
    std::printf("%s: focal length off by %.4f %% (median of %d; OpenCV %.4f %%), NEES %.2f of %.0f\n",
                lens.name, 100 * median(ours), runs, 100 * median(theirs), nees, numbers);
    EXPECT_LT(median(ours), 5e-4) << lens.name;
    EXPECT_LT(median(ours), 1.02 * median(theirs))
        << lens.name;  // the optimum is the same except for the outlier gate
    EXPECT_NEAR(nees, numbers, 3.5 * std::sqrt(2 * numbers / runs)) << lens.name;
  }
}

}  // namespace
}  // namespace waymark
