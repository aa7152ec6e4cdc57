#pragma once

// No Eigen here: what includes this may be compiled for a newer processor than the rest of the program, and
// an inline function of a library, compiled so, must not become the one the whole program uses.

namespace waymark::refinement {

/// Values handled side by side. L is a type of kLanes floats with the operators and members of Eigen's
/// arrays: `Lanes` (lanes.hpp) everywhere, `Avx2Lanes` (avx2_lanes.hpp) where the processor has AVX2.
inline constexpr int kLanes = 8;

/// kLanes floats from and to memory, of any alignment.
template <class L>
L load(const float* lanes);
template <class L>
void store(const L& lanes, float* to);

/// 1 where x > 0, else 0; x must be finite and either 0 or no smaller than 1e-20. Written without select(),
/// which Eigen 3.4 does lane by lane.
template <class L>
[[gnu::always_inline]] inline L positive(const L& x) {
  return (1e20F * x).max(0.0F).min(1.0F);
}

/// -1, 0 or 1.
template <class L>
[[gnu::always_inline]] inline L sign(const L& x) {
  return (1e20F * x).max(-1.0F).min(1.0F);
}

/// Standard normal distribution function and density at the same place.
template <class L>
struct NormalLanes {
  L cdf;
  L pdf;
};

/// |error| of both < 3e-5, a hundredth of a grey level at full contrast. exp(-z^2/2) is the 16th power of a
/// polynomial interpolating exp(-x) at the Chebyshev nodes of [0, 36/32]; the tail is Abramowitz and Stegun,
/// "Handbook of Mathematical Functions", 26.2.16. Beyond |z| = 6 both stay as they are there, so that squares
/// of densities stay normal numbers.
template <class L>
[[gnu::always_inline]] inline NormalLanes<L> normal_lanes(const L& z) {
  const L a = z.abs().min(6.0F);
  const L x = 0.03125F * a.square();
  L power = 0.999999142F +
            x * (-0.999944949F +
                 x * (0.499422111F + x * (-0.164419186F + x * (0.0376248759F - 0.00480211186F * x))));
  power = power.square();
  power = power.square();
  power = power.square();
  const L pdf = 0.39894228F * power.square();
  const L t = (1.0F + 0.33267F * a).inverse();
  const L tail = pdf * t * (0.4361836F + t * (-0.1201676F + 0.9372980F * t));
  return {0.5F + sign<L>(z) * (0.5F - tail), pdf};
}

/// The integral of (1 - y^2)^5 up to y, less 1/2 and over y, by y^2; y from -1 to 1.
template <class L>
[[gnu::always_inline]] inline L bell_cdf_series(const L& y2) {
  return 1.35351563F +
         y2 * (-2.25585938F +
               y2 * (2.70703125F + y2 * (-1.93359375F + y2 * (0.751953125F - 0.123046875F * y2))));
}

/// A cheap distribution function of nearly the same shape, for what is small anyway: its density is (1 -
/// (z/a)^2)^5 with variance 1. Differs from the normal one by less than 0.012.
template <class L>
[[gnu::always_inline]] inline L bell_cdf(const L& z) {
  constexpr float kReach = 3.6055513F;  // a = sqrt(13)
  const L y = ((1.0F / kReach) * z).max(-1.0F).min(1.0F);
  const L y2 = y.square();
  return 0.5F + y * bell_cdf_series<L>(y2);
}

}  // namespace waymark::refinement
