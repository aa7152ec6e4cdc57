#include "waymark/replay/line_smoothing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/SparseCholesky>

namespace waymark::internal {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

/// Adds weight * |difference of `row` at point i|^2 to the normal equations.
template <std::size_t N>
void add_rows(Triplets& triplets, const std::array<double, N>& row, std::ptrdiff_t n, bool closed,
              const std::vector<double>& weight) {
  const auto width = static_cast<std::ptrdiff_t>(N);
  for (std::ptrdiff_t i = 0; i < (closed ? n : n - width + 1); ++i) {
    for (std::ptrdiff_t a = 0; a < width; ++a) {
      for (std::ptrdiff_t b = 0; b < width; ++b) {
        triplets.emplace_back((i + a) % n, (i + b) % n,
                              weight[static_cast<std::size_t>(i)] * row[static_cast<std::size_t>(a)] *
                                  row[static_cast<std::size_t>(b)]);
      }
    }
  }
}

Line solve(const Line& line, bool closed, const std::vector<double>& third,
           const std::vector<double>& second) {
  const auto n = static_cast<std::ptrdiff_t>(line.size());
  Triplets triplets;
  triplets.reserve(line.size() * 26);
  Eigen::MatrixX2d b(n, 2);
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    // The ends of an open line are where the robot was put: they count more than a point on the way.
    const double weight = !closed && (i == 0 || i + 1 == n) ? 10.0 : 1.0;
    triplets.emplace_back(i, i, weight);
    b.row(i) = weight * line[static_cast<std::size_t>(i)].transpose();
  }
  add_rows(triplets, std::array<double, 4>{-1, 3, -3, 1}, n, closed, third);
  add_rows(triplets, std::array<double, 3>{1, -2, 1}, n, closed, second);
  Sparse A(n, n);
  A.setFromTriplets(triplets.begin(), triplets.end());
  const Eigen::SimplicialLDLT<Sparse> factors(A);
  const Eigen::MatrixX2d x = factors.solve(b);
  Line result(line.size());
  for (std::ptrdiff_t i = 0; i < n; ++i) result[static_cast<std::size_t>(i)] = x.row(i).transpose();
  return result;
}

}  // namespace

std::vector<double> curvatures(const Line& line, bool closed) {
  const std::size_t n = line.size();
  std::vector<double> all(n, 0);
  for (std::size_t i = 0; i < n; ++i) {
    if (!closed && (i == 0 || i + 1 == n)) continue;
    const Eigen::Vector2d a = line[i] - line[(i + n - 1) % n];
    const Eigen::Vector2d b = line[(i + 1) % n] - line[i];
    const double turn = std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
    all[i] = turn / std::max((a.norm() + b.norm()) / 2, 1e-9);
  }
  if (!closed && n > 2) {
    all.front() = all[1];
    all.back() = all[n - 2];
  }
  return all;
}

Line smooth_line(const Line& line, bool closed, double step_m, double wave_m, double max_curvature_1_m) {
  constexpr int kRounds = 25;
  if (line.size() < 8 || wave_m < 2 * step_m) return line;
  const double third = std::pow(wave_m / (2 * std::numbers::pi * step_m), 6);
  const std::vector<double> thirds(line.size(), third);
  std::vector<double> seconds(line.size(), 0);
  Line result = solve(line, closed, thirds, seconds);
  if (max_curvature_1_m <= 0) return result;
  const std::size_t n = line.size();
  for (int round = 0; round < kRounds; ++round) {
    bool straight_enough = true;
    const std::vector<double> bent = curvatures(result, closed);
    for (std::size_t i = 0; i < n; ++i) {
      if (std::abs(bent[i]) <= max_curvature_1_m * 0.99) continue;
      straight_enough = straight_enough && std::abs(bent[i]) <= max_curvature_1_m;
      const std::size_t row = (i + n - 1) % n;  // whose middle is this point
      seconds[row] = std::max(1.0, 1.5 * seconds[row]);
    }
    if (straight_enough) break;
    result = solve(line, closed, thirds, seconds);
  }
  return result;
}

}  // namespace waymark::internal
