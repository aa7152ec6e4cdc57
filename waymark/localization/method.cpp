#include "waymark/localization/method.hpp"

#include <cmath>

#include <Eigen/Eigenvalues>

namespace waymark {

double LocalizationEstimate::position_sigma_m() const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance.topLeftCorner<2, 2>(),
                                                              Eigen::EigenvaluesOnly);
  return std::sqrt(solver.eigenvalues().maxCoeff());
}

}  // namespace waymark
