#pragma once

#include <optional>
#include <vector>

#include "waymark/localization/riekf.hpp"

namespace waymark {

/// Do residuals of one landmark average away as fast as the filter believes? The mean of n whitened residuals
/// has the covariance S - I (what stays, or is the state's) + I / n; a filter that takes a lasting error for
/// noise finds means far beyond that although every single residual looks right. After Bar-Shalom, Li and
/// Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 5.4.2 (tests on
/// autocorrelation), for a filter whose innovations may be correlated. No allocation.
class LastingErrors {
 public:
  explicit LastingErrors(int landmarks) : all_(static_cast<std::size_t>(landmarks)) {}

  /// A residual and the covariance of its innovation.
  void add(const Linearised& z, const Eigen::Matrix<double, 8, 8>& S);
  /// NIS of the means so far over their degrees of freedom; nothing when they are few.
  [[nodiscard]] std::optional<double> mean() const;
  /// Sums over those means: twice their negative log-likelihood, without its constant, and degrees of
  /// freedom.
  [[nodiscard]] double cost() const { return cost_; }
  [[nodiscard]] double freedom() const { return freedom_; }

 private:
  struct Sums {
    Eigen::Matrix<double, 8, 1> residual = Eigen::Matrix<double, 8, 1>::Zero();
    Eigen::Matrix<double, 8, 8> S = Eigen::Matrix<double, 8, 8>::Zero();
    int count = 0;
  };
  std::vector<Sums> all_;
  double nis_ = 0;
  double cost_ = 0;
  double freedom_ = 0;
  int means_ = 0;
};

}  // namespace waymark
