#pragma once

#include <cstdint>
#include <span>

namespace waymark::search {

/// How much better a code explains the levels of a tag's cells than bits at random do, in bits: the logarithm
/// to base 2 of the likelihood ratio. A level far from the threshold says its bit with up to 0.96 bits, one
/// at the threshold says nothing, and one that is far on the wrong side costs 4. Under bits at random the
/// expectation of the ratio is one, so that they reach t bits with a probability of at most 2^-t (Markov's
/// inequality). `distances`: of all sampled cells from the threshold; `cells`: which of them are bits, most
/// significant first; `wrong_bits`: ones where the code differs from what was read. O(cells).
[[nodiscard]] float evidence_bits(std::span<const float> distances, std::span<const std::uint16_t> cells,
                                  std::uint64_t wrong_bits);

}  // namespace waymark::search
