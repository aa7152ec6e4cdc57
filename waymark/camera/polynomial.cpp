#include "waymark/camera/polynomial.hpp"

#include <algorithm>
#include <cstddef>

namespace waymark {
namespace {

/// The last double on low's side of the sign change between low and high.
double bisect(const Polynomial& p, double low, double high) {
  const bool sign = evaluate(p, low) > 0.0;
  while (true) {
    const double middle = low + 0.5 * (high - low);
    if (middle <= low || middle >= high) return low;
    ((evaluate(p, middle) > 0.0) == sign ? low : high) = middle;
  }
}

/// Every place in (0, high) where p changes its sign, ascending.
std::vector<double> sign_changes(const Polynomial& p, double high) {
  if (p.size() < 2) return {};
  std::vector<double> knots = sign_changes(derivative(p), high);
  knots.push_back(high);
  std::vector<double> changes;
  double low = 0.0;
  for (const double knot : knots) {
    if ((evaluate(p, low) > 0.0) != (evaluate(p, knot) > 0.0)) changes.push_back(bisect(p, low, knot));
    low = knot;
  }
  return changes;
}

}  // namespace

double evaluate(const Polynomial& p, double x) {
  double value = 0.0;
  for (auto c = p.rbegin(); c != p.rend(); ++c) value = value * x + *c;
  return value;
}

Polynomial derivative(const Polynomial& p) {
  Polynomial d;
  for (std::size_t i = 1; i < p.size(); ++i) d.push_back(static_cast<double>(i) * p[i]);
  return d;
}

Polynomial operator+(const Polynomial& a, const Polynomial& b) {
  Polynomial sum(std::max(a.size(), b.size()), 0.0);
  for (std::size_t i = 0; i < a.size(); ++i) sum[i] += a[i];
  for (std::size_t i = 0; i < b.size(); ++i) sum[i] += b[i];
  return sum;
}

Polynomial operator*(double factor, const Polynomial& p) {
  Polynomial scaled = p;
  for (double& c : scaled) c *= factor;
  return scaled;
}

Polynomial operator-(const Polynomial& a, const Polynomial& b) { return a + (-1.0 * b); }

Polynomial operator*(const Polynomial& a, const Polynomial& b) {
  if (a.empty() || b.empty()) return {};
  Polynomial product(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) product[i + j] += a[i] * b[j];
  }
  return product;
}

std::optional<double> last_positive_before_root(const Polynomial& p, double high) {
  const std::vector<double> changes = sign_changes(p, high);
  if (changes.empty()) return std::nullopt;
  return changes.front();
}

}  // namespace waymark
