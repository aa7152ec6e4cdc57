#include "waymark/localization/kept_numbers.hpp"

#include <cmath>

namespace waymark {

std::vector<bool> keep_given(const Eigen::MatrixXd& covariance, double enough_sigma,
                             Eigen::VectorXd& change) {
  std::vector<bool> kept(static_cast<std::size_t>(change.size()), false);
  Eigen::MatrixXd P = covariance;  // of those that may still move
  for (;;) {
    Eigen::Index least = -1;
    double least_sigmas = enough_sigma;
    for (Eigen::Index i = 0; i < change.size(); ++i) {
      if (kept[static_cast<std::size_t>(i)]) continue;
      const double sigmas = std::abs(change[i]) / std::sqrt(P(i, i));
      if (sigmas >= least_sigmas) continue;
      least = i;
      least_sigmas = sigmas;
    }
    if (least < 0) return kept;
    kept[static_cast<std::size_t>(least)] = true;
    const Eigen::VectorXd by = P.col(least) / P(least, least);
    change -= by * change[least];
    P -= by * P.row(least).eval();
    change[least] = 0;
  }
}

}  // namespace waymark
