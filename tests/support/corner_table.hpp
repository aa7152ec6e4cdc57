#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace waymark::testing {

/// Number of a tag's corners that are off by more than 0.5 px and five standard deviations.
inline int corners_far_off(const Eigen::Matrix<double, 8, 1>& error_px,
                           const Eigen::Matrix<double, 8, 8>& covariance_px2) {
  constexpr double kLeastErrorPx = 0.5;
  constexpr double kSigmas = 5;
  int far_off = 0;
  for (Eigen::Index at = 0; at < 8; at += 2) {
    const Eigen::Vector2d error = error_px.segment<2>(at);
    const Eigen::Matrix2d covariance = covariance_px2.block<2, 2>(at, at);
    const bool beyond = error.dot(covariance.llt().solve(error)) > kSigmas * kSigmas;
    far_off += error.norm() > kLeastErrorPx && beyond ? 1 : 0;
  }
  return far_off;
}

/// Corner errors and their normalised squares, summed over tags: a line of a table.
class CornerLine {
 public:
  using Corners = std::array<Eigen::Vector2d, 4>;
  using Covariance = Eigen::Matrix<double, 8, 8>;

  void add(const Corners& truth, const Corners& before, const Corners& after, const Covariance& covariance) {
    Eigen::Matrix<double, 8, 1> error;
    const Eigen::Vector2d center = 0.25 * (truth[0] + truth[1] + truth[2] + truth[3]);
    for (std::size_t k = 0; k < 4; ++k) {
      const auto at = 2 * static_cast<Eigen::Index>(k);
      const Eigen::Vector2d e = after[k] - truth[k];
      error.segment<2>(at) = e;
      before_ += (before[k] - truth[k]).squaredNorm() / 4;
      after_ += e.squaredNorm() / 4;
      worst_ = std::max(worst_, e.norm());
      bias_ += e / 4;
      outward_ += e.dot((truth[k] - center).normalized()) / 4;
      nees_corner_ += e.dot(covariance.block<2, 2>(at, at).llt().solve(e)) / 8;
    }
    far_off_ += corners_far_off(error, covariance);
    nees_tag_ += error.dot(covariance.llt().solve(error)) / 8;
    promised_ += covariance.trace() / 4;
    ++tags_;
  }

  [[nodiscard]] std::size_t tags() const { return tags_; }
  [[nodiscard]] double rmse_before_px() const {
    return std::sqrt(before_ / n());
  }  ///< root mean square Euclidean error
  [[nodiscard]] double rmse_px() const { return std::sqrt(after_ / n()); }
  [[nodiscard]] double promised_px() const {
    return std::sqrt(promised_ / n());
  }  ///< the same according to the covariances
  [[nodiscard]] double worst_px() const { return worst_; }
  [[nodiscard]] int far_off() const { return far_off_; }  ///< see corners_far_off()
  [[nodiscard]] Eigen::Vector2d bias_px() const { return bias_ / n(); }
  [[nodiscard]] double outward_px() const { return outward_ / n(); }
  /// Mean normalised error squared over its degrees of freedom, 8 per tag: 1 if the covariances are
  /// consistent, more if they are too small.
  [[nodiscard]] double nees_tag() const { return nees_tag_ / n(); }
  [[nodiscard]] double nees_corner() const { return nees_corner_ / n(); }  ///< 2 per corner

  static void print_header() {
    std::printf("%-16s %6s %8s %8s %8s %7s %7s %7s %8s %8s %8s\n", "", "tags", "before", "rmse", "promised",
                "worst", "nees/8", "nees/2", "bias x", "bias y", "outward");
  }
  void print(const std::string& name) const {
    std::printf("%-16s %6zu %8.4f %8.4f %8.4f %7.3f %7.2f %7.2f %+8.4f %+8.4f %+8.4f\n", name.c_str(), tags_,
                rmse_before_px(), rmse_px(), promised_px(), worst_, nees_tag(), nees_corner(), bias_px().x(),
                bias_px().y(), outward_px());
  }

 private:
  [[nodiscard]] double n() const { return std::max<double>(1.0, static_cast<double>(tags_)); }

  std::size_t tags_ = 0;
  int far_off_ = 0;
  double before_ = 0, after_ = 0, promised_ = 0, worst_ = 0, outward_ = 0, nees_tag_ = 0, nees_corner_ = 0;
  Eigen::Vector2d bias_{0, 0};
};

}  // namespace waymark::testing
