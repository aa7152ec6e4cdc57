#pragma once

#include <Eigen/Core>

namespace waymark::refinement {

/// Values handled side by side; what the compiler makes of it (SSE, AVX, NEON or a loop) is its business.
inline constexpr int kLanes = 8;
using Lanes = Eigen::Array<float, kLanes, 1>;

/// 1 where x > 0, else 0; x must be finite and either 0 or no smaller than 1e-20. Written without select(),
/// which Eigen 3.4 does lane by lane.
inline Lanes positive(const Lanes& x) { return (1e20F * x).max(0.0F).min(1.0F); }

/// -1, 0 or 1.
inline Lanes sign(const Lanes& x) { return (1e20F * x).max(-1.0F).min(1.0F); }

/// Standard normal distribution function and density at the same place.
struct NormalLanes {
  Lanes cdf;
  Lanes pdf;
};

/// |error| of both < 3e-5, a hundredth of a grey level at full contrast. exp(-z^2/2) is the 16th power of a
/// polynomial interpolating exp(-x) at the Chebyshev nodes of [0, 36/32]; the tail is Abramowitz and Stegun,
/// "Handbook of Mathematical Functions", 26.2.16. Beyond |z| = 6 both stay as they are there, so that squares
/// of densities stay normal numbers.
[[gnu::always_inline]] inline NormalLanes normal_lanes(const Lanes& z) {
  const Lanes a = z.abs().min(6.0F);
  const Lanes x = 0.03125F * a.square();
  Lanes power = 0.999999142F +
                x * (-0.999944949F +
                     x * (0.499422111F + x * (-0.164419186F + x * (0.0376248759F - 0.00480211186F * x))));
  power = power.square();
  power = power.square();
  power = power.square();
  const Lanes pdf = 0.39894228F * power.square();
  const Lanes t = (1.0F + 0.33267F * a).inverse();
  const Lanes tail = pdf * t * (0.4361836F + t * (-0.1201676F + 0.9372980F * t));
  return {0.5F + sign(z) * (0.5F - tail), pdf};
}

/// A cheap distribution function of nearly the same shape, for what is small anyway: its density is (1 -
/// (z/a)^2)^5 with variance 1. Differs from the normal one by less than 0.012.
inline Lanes bell_cdf(const Lanes& z) {
  constexpr float kReach = 3.6055513F;  // a = sqrt(13)
  const Lanes y = ((1.0F / kReach) * z).max(-1.0F).min(1.0F);
  const Lanes y2 = y.square();
  return 0.5F +
         y * (1.35351563F +
              y2 * (-2.25585938F +
                    y2 * (2.70703125F + y2 * (-1.93359375F + y2 * (0.751953125F - 0.123046875F * y2)))));
}

}  // namespace waymark::refinement
