#include "waymark/app/common/corner_error.hpp"

#include <optional>

#include "waymark/geometry/dense.hpp"
#include "waymark/pose/multi_tag_pose.hpp"
#include "waymark/pose/square_pose.hpp"

namespace waymark {
namespace {

constexpr int kFewest = 20;        // residuals beyond the unknowns
constexpr double kMost_px = 10;    // no corner that joins a pose errs by more
constexpr double kStep_px = 1e-4;  // that the answer is known to

using Vector8 = Eigen::Matrix<double, 8, 1>;

CornerCovariance covariance_of(const TagDetection& detection) {
  const double usual_px = MultiTagOptions{}.corner_sigma_px;
  return detection.corner_covariance_px2.value_or(usual_px * usual_px * CornerCovariance::Identity());
}

/// Residuals of a tag's corners along the axes of their covariance.
struct Residuals {
  Vector8 squares_px2;
  Vector8 variances_px2;

  [[nodiscard]] double chi2(double sigma_px) const {
    return (squares_px2.array() / (variances_px2.array() + sigma_px * sigma_px)).sum();
  }
};

std::optional<Residuals> residuals_of(const TagDetection& detection, const SE3& cam_T_map, const TagMap& map,
                                      const CameraModel& camera) {
  const MappedTag* tag = map.find(detection.tag);
  if (tag == nullptr) return std::nullopt;
  const auto corners = square_corners(tag->size_m);
  Vector8 off_px;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto px = camera.project(cam_T_map * (tag->map_T_tag * corners[k]));
    if (!px) return std::nullopt;
    off_px.segment<2>(static_cast<Eigen::Index>(2 * k)) = detection.corners_px[k] - *px;
  }
  const SymmetricEigen<8> axes = symmetric_eigen<8>(covariance_of(detection));
  if (!axes.converged) return std::nullopt;
  return Residuals{(axes.vectors.transpose() * off_px).cwiseAbs2(), axes.values.cwiseMax(0)};
}

}  // namespace

double common_corner_error_px(const std::vector<PosedTags>& pictures, const TagMap& map,
                              const CameraModel& camera) {
  std::vector<Residuals> all;
  double left_over = 0;
  for (const PosedTags& picture : pictures) {
    const std::size_t before = all.size();
    for (const TagDetection& detection : picture.detections)
      if (const auto one = residuals_of(detection, picture.cam_T_map, map, camera)) all.push_back(*one);
    if (all.size() > before) left_over += 8.0 * static_cast<double>(all.size() - before) - 6;
  }
  if (left_over < kFewest) return 0;
  const auto too_large = [&](double sigma_px) {
    double chi2 = 0;
    for (const Residuals& one : all) chi2 += one.chi2(sigma_px);
    return !(chi2 <= left_over);  // also where a covariance is singular
  };
  if (!too_large(0)) return 0;
  double low = 0, high = kMost_px;
  while (high - low > kStep_px) (too_large((low + high) / 2) ? low : high) = (low + high) / 2;
  return high;
}

TagFrame with_corner_error(TagFrame frame, double sigma_px) {
  for (TagDetection& detection : frame.detections)
    detection.corner_covariance_px2 =
        covariance_of(detection) + sigma_px * sigma_px * CornerCovariance::Identity();
  return frame;
}

}  // namespace waymark
