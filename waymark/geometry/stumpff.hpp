#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace waymark {

/// The Stumpff functions c_k(s) = sum_i (-s)^i / (k + 2i)!, k = 0 … 5, of s = theta^2 >= 0 (Stumpff,
/// "Himmelsmechanik I", 1959; docs/concepts/geometry.md, equation (12)). All exponentials and Jacobians in
/// this room have these coefficients:
///
///     c0 = cos theta             c1 = sin theta / theta              c2 = (1 - cos theta) / theta^2
///     c3 = (theta - sin theta) / theta^3     c_{k+2} = (1/k! - c_k) / s
struct Stumpff {
  double c0 = 1.0, c1 = 1.0, c2 = 1.0 / 2, c3 = 1.0 / 6, c4 = 1.0 / 24, c5 = 1.0 / 120;
};

namespace internal {

/// Below this s the series is used, above it the closed forms. At s = 4 (theta = 2 rad), the upward
/// recurrence loses less than four bits in c4 and c5. Eleven terms of the series are accurate there to the
/// last bit of a double.
inline constexpr double kSeriesLimit = 4.0;
inline constexpr int kSeriesTerms = 11;

/// The coefficients 1 / (k + 2i)!.
template <int k>
[[nodiscard]] consteval std::array<double, kSeriesTerms> stumpff_coefficients() {
  std::array<double, kSeriesTerms> coefficients{};
  double factorial = 1.0;
  int n = 1;
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    for (; n <= k + 2 * static_cast<int>(i); ++n) factorial *= n;
    coefficients[i] = 1.0 / factorial;
  }
  return coefficients;
}

/// c_k by its series, for 0 <= s <= kSeriesLimit.
template <int k>
[[nodiscard]] inline double stumpff_series(double s) {
  constexpr auto kCoefficients = stumpff_coefficients<k>();
  double sum = kCoefficients.back();
  for (std::size_t i = kCoefficients.size() - 1; i-- > 0;) sum = kCoefficients[i] - s * sum;
  return sum;
}

}  // namespace internal

/// All six functions of s = theta^2 >= 0. The error is below 4e-15 up to theta = 2 pi. It is relative, except
/// for functions that pass through 0 (c0, c1, and c2 at 2 pi), where it is absolute.
[[nodiscard]] inline Stumpff stumpff(double s) {
  Stumpff c;
  if (s <= internal::kSeriesLimit) {
    c.c4 = internal::stumpff_series<4>(s);
    c.c5 = internal::stumpff_series<5>(s);
    c.c3 = 1.0 / 6 - s * c.c5;
    c.c2 = 1.0 / 2 - s * c.c4;
    c.c1 = 1.0 - s * c.c3;
    c.c0 = 1.0 - s * c.c2;
    return c;
  }
  const double theta = std::sqrt(s);
  const double half_sine = std::sin(theta / 2);
  const double half_cosine = std::cos(theta / 2);
  c.c0 = half_cosine * half_cosine - half_sine * half_sine;
  c.c1 = 2 * half_sine * half_cosine / theta;
  c.c2 = 2 * half_sine * half_sine / s;  // computing 1 - c0 would cause cancellation near 2 pi
  c.c3 = (1.0 - c.c1) / s;
  c.c4 = (1.0 / 2 - c.c2) / s;
  c.c5 = (1.0 / 6 - c.c3) / s;
  return c;
}

/// e(s) = (1 - (theta/2) cot(theta/2)) / theta^2, the coefficient of the quadratic term in an inverse
/// Jacobian (equation (16)). It is computed as (c2 - c3) / (4 c1) at s/4, which has no cancellation at 0 and
/// is finite up to, but not including, theta = 2 pi.
[[nodiscard]] inline double inverse_jacobian_coefficient(double s) {
  const Stumpff half = stumpff(s / 4);
  return (half.c2 - half.c3) / (4 * half.c1);
}

}  // namespace waymark
