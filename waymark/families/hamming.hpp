#pragma once

#include <bit>
#include <cstdint>
#include <functional>
#include <vector>

#include "waymark/families/family.hpp"

namespace waymark {

/// The number of bits in which two codes differ (Martins and Ramos, "AprilTag-based Trajectory Tracking for
/// the LIMOS Robot", eq. 2.14).
[[nodiscard]] inline int hamming_distance(std::uint64_t a, std::uint64_t b) { return std::popcount(a ^ b); }

/// Rotates the codes of a family in steps of 90 degrees, for any layout: a rotation permutes the data bits in
/// the same way as their cells.
class CodeRotation {
 public:
  /// The layout must map to itself under a quarter turn, as all layouts in kAllFamilies do. O(bits^2).
  explicit CodeRotation(const Family& family);

  /// The code read from the same print after it has been rotated clockwise, as seen by the reader, by
  /// `quarter_turns` * 90 degrees (any integer; negative values rotate counter-clockwise). O(bits).
  [[nodiscard]] std::uint64_t turned(std::uint64_t code, int quarter_turns) const;

  /// The smallest Hamming distance between `a` and the four rotations of `b` (eq. 2.15 of the same report).
  /// Symmetric.
  [[nodiscard]] int min_rotational_distance(std::uint64_t a, std::uint64_t b) const;

 private:
  std::vector<int> source_shift_;  ///< for each bit of the rotated code, least significant bit first, the bit
                                   ///< it is taken from
};

/// The smallest distance between two codes of the family in any of the four relative rotations, and between a
/// code and its rotations by 90, 180 and 270 degrees. The latter ensure that the orientation of a tag is
/// unambiguous. The result is exact; the families with tens of thousands of codes take a second or two
/// (Norouzi, Punjani and Fleet, "Fast search in Hamming space with multi-index hashing", CVPR 2012).
/// `cancelled` is polled; once it returns true, the function soon returns with a meaningless result.
[[nodiscard]] int minimum_distance(
    const Family& family, const std::function<bool()>& cancelled = [] { return false; });

}  // namespace waymark
