#pragma once

// Arithmetic on several pixels at once, as templates over the type of lanes. Eigen is not included here,
// because a file that includes this one may be compiled for a newer processor than the rest of the program.
// Inline library functions compiled that way must not be linked into the rest.
namespace waymark::refinement {

/// Number of values processed in parallel. L is a type that holds kLanes floats and has the operators and
/// members of Eigen's arrays: `Lanes` (edge_model.hpp) on all processors, `Avx2Lanes` (avx2_lanes.hpp) on
/// processors with AVX2.
inline constexpr int kLanes = 8;

/// Load kLanes floats from memory and store them, with any alignment.
template <class L>
L load(const float* lanes);
template <class L>
void store(const L& lanes, float* to);

/// 1 where x > 0, else 0. x must be finite and either 0 or at least 1e-20. Written without select(), which
/// Eigen 3.4 evaluates lane by lane.
template <class L>
[[gnu::always_inline]] inline L positive(const L& x) {
  return (1e20F * x).max(0.0F).min(1.0F);
}

/// The sign: -1, 0 or 1.
template <class L>
[[gnu::always_inline]] inline L sign(const L& x) {
  return (1e20F * x).max(-1.0F).min(1.0F);
}

/// The standard normal distribution function and its density at the same argument.
template <class L>
struct NormalLanes {
  L cdf;
  L pdf;
};

/// The absolute errors of both are below 3e-5, a hundredth of a grey level at full contrast. The factor
/// exp(-z^2/2) is the 16th power of a polynomial that interpolates exp(-x) at the Chebyshev nodes of [0,
/// 36/32]. The tail is from Abramowitz and Stegun, "Handbook of Mathematical Functions", 26.2.16. Beyond |z|
/// = 6 both are constant, so squares of densities remain normal numbers.
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

/// A cheap distribution function of nearly the same shape, for small terms. Its density is (1 - (z/a)^2)^5,
/// with variance 1. It differs from the normal distribution function by less than 0.012.
template <class L>
[[gnu::always_inline]] inline L bell_cdf(const L& z) {
  constexpr float kReach = 3.6055513F;  // a = sqrt(13)
  const L y = ((1.0F / kReach) * z).max(-1.0F).min(1.0F);
  const L y2 = y.square();
  return 0.5F +
         y * (1.35351563F +
              y2 * (-2.25585938F +
                    y2 * (2.70703125F + y2 * (-1.93359375F + y2 * (0.751953125F - 0.123046875F * y2)))));
}

/// Grey levels at or beyond these limits count as saturated.
inline constexpr float kDarkest = 1.0F;
inline constexpr float kBrightest = 253.0F;

/// 0 if both the model and the pixel are saturated, else 1. The pixel need not be exactly at the end of the
/// range, because counting only the low half of the noise there would bias the level downwards.
template <class L>
[[gnu::always_inline]] inline L within_scale(const L& value, const L& predicted) {
  constexpr float kNoise = 12.0F;
  const L dark = positive<L>(kDarkest + kNoise - value) * positive<L>(kDarkest - predicted);
  const L bright = positive<L>(value - (kBrightest - kNoise)) * positive<L>(predicted - kBrightest);
  return 1.0F - dark - bright;
}

}  // namespace waymark::refinement
