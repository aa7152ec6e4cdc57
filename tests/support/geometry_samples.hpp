#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"

namespace waymark::testing {

/// A tangent with a rotation by `angle` [rad] about a random axis (sign for plane groups) and normal
/// translations times `size` [m].
template <LieGroup G>
[[nodiscard]] typename G::Tangent random_tangent(Random& random, double angle, double size) {
  typename G::Tangent xi;
  for (int i = 0; i < G::kDof; ++i) xi[i] = size * random.normal();
  auto rotation = xi.template tail<G::kRotationDof>();
  rotation *= angle / rotation.norm();
  return xi;
}

/// Angles at which exp, log and their Jacobians are prone to errors: near 0, around every switch between a
/// series and a closed form, near pi.
[[nodiscard]] inline std::vector<double> critical_angles() {
  constexpr double kPi = std::numbers::pi;
  return {0.0, 1e-160, 1e-12, 1e-9,  1e-7,      1e-5,       1.9e-4,     2.1e-4,     1e-3,
          0.1, 1.0,    1.999, 2.001, kPi - 0.1, kPi - 1e-3, kPi - 1e-6, kPi - 1e-9, kPi - 1e-12};
}

/// Tangents over all critical angles and translations of 0, 1 um, 1 m and 10 m.
template <LieGroup G>
[[nodiscard]] std::vector<typename G::Tangent> critical_tangents(std::uint64_t seed) {
  Random random(seed);
  std::vector<typename G::Tangent> all;
  for (const double angle : critical_angles()) {
    for (const double size : {1e-6, 1.0, 10.0}) all.push_back(random_tangent<G>(random, angle, size));
    all.push_back(random_tangent<G>(random, angle, 1.0));
    all.back().template head<G::kDof - G::kRotationDof>().setZero();
  }
  return all;
}

/// Elements with moderate tangents: angles up to 2.8 rad, translations of metres.
template <LieGroup G>
[[nodiscard]] G random_element(Random& random, double max_angle = 2.8, double size = 2.0) {
  return G::exp(random_tangent<G>(random, random.uniform(0, max_angle), size));
}

}  // namespace waymark::testing
