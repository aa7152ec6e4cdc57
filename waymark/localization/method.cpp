#include "waymark/localization/method.hpp"
#include "waymark/geometry/dense.hpp"

#include <cmath>

namespace waymark {

double LocalizationEstimate::position_sigma_m() const {
  return std::sqrt(symmetric_eigenvalues<2>(covariance.topLeftCorner<2, 2>()).maxCoeff());
}

}  // namespace waymark
