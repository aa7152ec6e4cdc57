#pragma once

// Only for files that are compiled with AVX2 and FMA (CMakeLists.txt), and called only on processors that
// have them.
#include <immintrin.h>

#include "waymark/tags/refinement/lanes.hpp"

namespace waymark::refinement {

/// kLanes floats in one register, with the operators and members of Eigen's arrays that the sums
/// use.
struct Avx2Lanes {
  __m256 v;

  Avx2Lanes() : v(_mm256_setzero_ps()) {}
  Avx2Lanes(__m256 values) : v(values) {}                         // NOLINT: implicit like Eigen's arrays
  Avx2Lanes(float everywhere) : v(_mm256_set1_ps(everywhere)) {}  // NOLINT: a scalar broadcast like in Eigen

  [[nodiscard]] static Avx2Lanes Zero() { return {}; }
  [[nodiscard]] static Avx2Lanes Constant(float everywhere) { return everywhere; }

  [[nodiscard]] Avx2Lanes min(Avx2Lanes b) const { return _mm256_min_ps(v, b.v); }
  [[nodiscard]] Avx2Lanes max(Avx2Lanes b) const { return _mm256_max_ps(v, b.v); }
  [[nodiscard]] Avx2Lanes abs() const { return _mm256_andnot_ps(_mm256_set1_ps(-0.0F), v); }
  [[nodiscard]] Avx2Lanes square() const { return v * v; }
  [[nodiscard]] Avx2Lanes inverse() const { return _mm256_set1_ps(1.0F) / v; }
  [[nodiscard]] float sum() const {
    const __m128 four = _mm256_castps256_ps128(v) + _mm256_extractf128_ps(v, 1);
    const __m128 two = four + _mm_movehl_ps(four, four);
    return _mm_cvtss_f32(two) + _mm_cvtss_f32(_mm_movehdup_ps(two));
  }

  Avx2Lanes& operator+=(Avx2Lanes b) { return *this = v + b.v; }
  Avx2Lanes& operator-=(Avx2Lanes b) { return *this = v - b.v; }
  Avx2Lanes& operator*=(Avx2Lanes b) { return *this = v * b.v; }
  friend Avx2Lanes operator+(Avx2Lanes a, Avx2Lanes b) { return a.v + b.v; }
  friend Avx2Lanes operator-(Avx2Lanes a, Avx2Lanes b) { return a.v - b.v; }
  friend Avx2Lanes operator*(Avx2Lanes a, Avx2Lanes b) { return a.v * b.v; }
  friend Avx2Lanes operator-(Avx2Lanes a) { return -a.v; }
};

template <>
inline Avx2Lanes load<Avx2Lanes>(const float* lanes) {
  return _mm256_loadu_ps(lanes);
}
template <>
inline void store<Avx2Lanes>(const Avx2Lanes& lanes, float* to) {
  _mm256_storeu_ps(to, lanes.v);
}

}  // namespace waymark::refinement
