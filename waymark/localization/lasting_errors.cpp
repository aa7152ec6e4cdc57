#include "waymark/localization/lasting_errors.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace waymark {

void LastingErrors::add(const Linearised& z, const Eigen::Matrix<double, 8, 8>& S) {
  constexpr int kOneMean = 30;
  Sums& sums = all_[static_cast<std::size_t>(z.landmark)];
  sums.residual += z.residual;
  sums.S += S;
  if (++sums.count < kOneMean) return;
  const double n = sums.count;
  const Eigen::Matrix<double, 8, 1> mean = sums.residual / n;
  Eigen::Matrix<double, 8, 8> expected = sums.S / n;
  expected.diagonal().array() += 1 / n - 1;
  const Eigen::LLT<Eigen::Matrix<double, 8, 8>> llt(expected);
  if (llt.info() == Eigen::Success) {
    const double nis = mean.dot(llt.solve(mean));
    constexpr double kCapPerRow = 16;
    nis_ += nis;
    cost_ += std::min(nis, kCapPerRow * z.rows);
    for (Eigen::Index i = 0; i < z.rows; ++i) cost_ += 2 * std::log(llt.matrixLLT()(i, i));
    freedom_ += z.rows;
    ++means_;
  }
  sums = {};
}

std::optional<double> LastingErrors::mean() const {
  constexpr int kFew = 20;
  if (means_ < kFew) return std::nullopt;
  return nis_ / freedom_;
}

}  // namespace waymark
