#pragma once

#include <optional>
#include <vector>

namespace waymark {

/// Coefficients of a real polynomial in ascending order: c[0] + c[1] x + c[2] x^2 + ...
using Polynomial = std::vector<double>;

[[nodiscard]] double evaluate(const Polynomial& p, double x);
[[nodiscard]] Polynomial derivative(const Polynomial& p);
[[nodiscard]] Polynomial operator+(const Polynomial& a, const Polynomial& b);
[[nodiscard]] Polynomial operator-(const Polynomial& a, const Polynomial& b);
[[nodiscard]] Polynomial operator*(const Polynomial& a, const Polynomial& b);
[[nodiscard]] Polynomial operator*(double factor, const Polynomial& p);

/// Where a polynomial that is positive at 0 first stops being positive in (0, high]: the largest x found such
/// that it is still positive at x and not at the next double. Nothing when it stays positive. Between two
/// neighbouring zeros of its derivative a polynomial is monotone, so that bisection there misses no crossing.
/// O(degree^2) bisections.
[[nodiscard]] std::optional<double> last_positive_before_root(const Polynomial& p, double high);

}  // namespace waymark
