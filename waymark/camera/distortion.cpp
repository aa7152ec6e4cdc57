#include "waymark/camera/distortion.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace waymark {
namespace {

/// The last double on the `low` side of the sign change between low and high.
double bisect(const Polynomial& p, double low, double high) {
  const bool sign = evaluate(p, low) > 0.0;
  while (true) {
    const double middle = low + 0.5 * (high - low);
    if (middle <= low || middle >= high) return low;
    ((evaluate(p, middle) > 0.0) == sign ? low : high) = middle;
  }
}

/// All sign changes of p in (0, high), in ascending order.
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

namespace {

/// Results stay inside the domain by this relative margin, so that they project again after rounding.
constexpr double kInside = 1.0 - 1e-14;
/// At a fold the map is flat, so rounding a pixel may move a point on the edge beyond it by this relative
/// amount.
constexpr double kRimSlack = 2e-14;

/// Solves f(x) = target on [low, high] for an increasing f with f(low) <= target <= f(high). Uses Newton's
/// method, with bisection if Newton leaves the bracket or converges too slowly ("rtsafe", Press et al.,
/// "Numerical Recipes", section 9.4).
template <class Function>
double solve_increasing(Function&& f, double target, double low, double high) {
  constexpr int kMaxIterations = 200;
  double x = std::clamp(target, low, high);
  double last_step = high - low;
  for (int i = 0; i < kMaxIterations; ++i) {
    double slope = 0.0;
    const double error = f(x, &slope) - target;
    if (error == 0.0) return x;
    (error < 0.0 ? low : high) = x;
    double next = x - error / slope;
    const bool poor = !(next > low && next < high) || std::abs(next - x) > 0.5 * last_step;
    if (poor) next = low + 0.5 * (high - low);
    last_step = std::abs(next - x);
    if (last_step <= 2e-16 * std::abs(x)) return next;
    x = next;
  }
  return x;
}

/// g(s) and its derivative.
struct RadialFactor {
  double value = 1.0;
  double slope = 0.0;
};

RadialFactor radial_factor(const std::array<double, 8>& k, double s) {
  const double numerator = 1.0 + s * (k[0] + s * (k[1] + s * k[4]));
  const double denominator = 1.0 + s * (k[5] + s * (k[6] + s * k[7]));
  const double numerator_slope = k[0] + s * (2.0 * k[1] + s * 3.0 * k[4]);
  const double denominator_slope = k[5] + s * (2.0 * k[6] + s * 3.0 * k[7]);
  const double value = numerator / denominator;
  return {value, (numerator_slope - value * denominator_slope) / denominator};
}

/// r g(r^2); if `slope` is not null, it receives the derivative A.
double radial(const std::array<double, 8>& k, double r, double* slope) {
  const RadialFactor g = radial_factor(k, r * r);
  if (slope != nullptr) *slope = g.value + 2.0 * r * r * g.slope;
  return r * g.value;
}

}  // namespace

bool Radtan::is_identity() const {
  return std::all_of(k.begin(), k.end(), [](double c) { return c == 0.0; });
}

Eigen::Vector2d Radtan::distort(const Eigen::Vector2d& undistorted, Eigen::Matrix2d* J) const {
  const double x = undistorted.x();
  const double y = undistorted.y();
  const double p1 = k[2];
  const double p2 = k[3];
  const double s = x * x + y * y;
  const RadialFactor g = radial_factor(k, s);
  if (J != nullptr) {
    const double cross = 2.0 * (g.slope * x * y + p1 * x + p2 * y);
    *J << g.value + 2.0 * g.slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x, cross,  //
        cross, g.value + 2.0 * g.slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x;
  }
  return {x * g.value + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
          y * g.value + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y};
}

std::optional<Eigen::Vector2d> Radtan::undistort(const Eigen::Vector2d& distorted, double limit) const {
  const double radius_d = distorted.norm();
  if (!std::isfinite(radius_d)) return std::nullopt;
  if (is_identity() || radius_d == 0.0) return distorted;
  const double rim = radial(k, limit, nullptr);
  const bool tangential = k[2] != 0.0 || k[3] != 0.0;
  if (!tangential && radius_d > rim + kRimSlack * (1.0 + rim)) return std::nullopt;

  const auto f = [this](double r, double* slope) { return radial(k, r, slope); };
  const double r = std::min(solve_increasing(f, std::min(radius_d, rim), 0.0, limit), limit * kInside);
  Eigen::Vector2d undistorted = distorted * (r / radius_d);
  if (!tangential) return undistorted;

  constexpr int kMaxIterations = 100;
  const double tolerance = 1e-13 * (1.0 + radius_d);
  double error = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMaxIterations; ++i) {
    Eigen::Matrix2d J;
    const Eigen::Vector2d residual = distorted - distort(undistorted, &J);
    const double determinant = J(0, 0) * J(1, 1) - J(0, 1) * J(1, 0);
    const bool settled = error <= tolerance && residual.norm() >= error;
    error = residual.norm();
    if (settled || error == 0.0 || !(determinant > 0.0)) break;
    undistorted += Eigen::Vector2d(J(1, 1) * residual.x() - J(0, 1) * residual.y(),
                                   J(0, 0) * residual.y() - J(1, 0) * residual.x()) /
                   determinant;
    const double radius = undistorted.norm();
    if (radius > limit * kInside) undistorted *= limit * kInside / radius;
  }
  if (!(error <= tolerance)) return std::nullopt;
  return undistorted;
}

double Radtan::domain() const {
  if (is_identity()) return std::numeric_limits<double>::infinity();
  const Polynomial numerator = {1.0, 0.0, k[0], 0.0, k[1], 0.0, k[4]};
  const Polynomial denominator = {1.0, 0.0, k[5], 0.0, k[6], 0.0, k[7]};
  const Polynomial r = {0.0, 1.0};
  const Polynomial tangential = (6.0 * std::hypot(k[2], k[3])) * r;
  // A and B, multiplied by powers of the denominator so that they become polynomials.
  const Polynomial denominator_squared = denominator * denominator;
  const Polynomial slope = numerator * denominator +
                           r * (derivative(numerator) * denominator - numerator * derivative(denominator));
  const Polynomial along = slope - tangential * denominator_squared;
  const Polynomial across = numerator - tangential * denominator;
  const Polynomial stretch = kLargestStretch * denominator_squared - slope;
  double limit = kLargestRadius;
  // The denominator does not need to be checked separately: before its first zero, g exceeds kLargestStretch
  // or falls to zero.
  for (const Polynomial& must_stay_positive : {along, across, stretch}) {
    limit = last_positive_before_root(must_stay_positive, limit).value_or(limit);
  }
  return limit;
}

double Radtan::distorted_radius(double limit) const {
  if (is_identity()) return limit;
  return radial(k, limit, nullptr) - 3.0 * std::hypot(k[2], k[3]) * limit * limit;
}

double EquidistantAngle::distort(double theta, double* slope) const {
  const double s = theta * theta;
  if (slope != nullptr) {
    *slope = 1.0 + s * (3.0 * k[0] + s * (5.0 * k[1] + s * (7.0 * k[2] + s * 9.0 * k[3])));
  }
  return theta * (1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))));
}

std::optional<double> EquidistantAngle::undistort(double theta_d, double limit) const {
  const double rim = distort(limit);
  if (!(theta_d <= rim + kRimSlack * (1.0 + rim))) return std::nullopt;
  const auto f = [this](double theta, double* slope) { return distort(theta, slope); };
  return std::min(solve_increasing(f, std::min(theta_d, rim), 0.0, limit), limit * kInside);
}

double EquidistantAngle::domain() const {
  const Polynomial slope = {1.0, 0.0, 3.0 * k[0], 0.0, 5.0 * k[1], 0.0, 7.0 * k[2], 0.0, 9.0 * k[3]};
  return last_positive_before_root(slope, std::numbers::pi).value_or(std::numbers::pi);
}

}  // namespace waymark
