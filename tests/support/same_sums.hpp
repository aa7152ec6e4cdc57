#pragma once

#include <cmath>

#include <gtest/gtest.h>

namespace waymark::testing {

/// Whether two implementations of normal equations agree up to rounding in single precision. `T` has
/// information, gradient and cost.
template <class T>
void expect_same_sums(const T& quick, const T& portable, int unknowns) {
  constexpr double kRounding = 2e-5;
  for (int i = 0; i < unknowns; ++i) {
    for (int k = 0; k < unknowns; ++k) {
      // Off the diagonal, terms of opposite signs cancel.
      const double scale = std::sqrt(portable.information(i, i) * portable.information(k, k));
      EXPECT_NEAR(quick.information(i, k), portable.information(i, k), kRounding * scale) << i << " " << k;
    }
    const double scale = std::sqrt(portable.information(i, i) * portable.cost);
    EXPECT_NEAR(quick.gradient[i], portable.gradient[i], kRounding * scale) << i;
  }
  EXPECT_NEAR(quick.cost, portable.cost, kRounding * portable.cost);
}

}  // namespace waymark::testing
