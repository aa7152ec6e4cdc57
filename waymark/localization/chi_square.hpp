#pragma once

#include <cmath>

namespace waymark {

/// The p-quantile of the standard normal distribution, p in (0, 1): bisection of erfc, for options, not for
/// inner loops.
[[nodiscard]] inline double normal_quantile(double p) {
  double low = -10;
  double high = 10;
  for (int i = 0; i < 80; ++i) {
    const double middle = (low + high) / 2;
    (std::erfc(-middle / std::sqrt(2.0)) / 2 < p ? low : high) = middle;
  }
  return (low + high) / 2;
}

/// The p-quantile of chi-square with n degrees of freedom, within 2 % for n >= 2 and p <= 0.99999 (Wilson and
/// Hilferty, "The Distribution of Chi-Square", PNAS 17, 1931).
[[nodiscard]] inline double chi_square_quantile(double p, double n) {
  const double a = 2 / (9 * n);
  const double root = 1 - a + normal_quantile(p) * std::sqrt(a);
  return n * root * root * root;
}

}  // namespace waymark
