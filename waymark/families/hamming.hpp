#pragma once

#include <bit>
#include <cstdint>
#include <functional>
#include <vector>

#include "waymark/families/family.hpp"

namespace waymark {

/// Number of bits in which two codes differ (Martins and Ramos, "AprilTag-based Trajectory Tracking for the
/// LIMOS Robot", eq. 2.14).
[[nodiscard]] inline int hamming_distance(std::uint64_t a, std::uint64_t b) { return std::popcount(a ^ b); }

/// Rotates the codes of a family in steps of 90 degrees, for any layout: a rotation permutes the data bits as
/// it permutes their cells.
class CodeRotation {
 public:
  /// The layout must map to itself under a quarter turn, as every layout of kAllFamilies does. O(bits^2).
  explicit CodeRotation(const Family& family);

  /// The code read from the same print after the print was rotated clockwise, as seen by its reader, by
  /// `quarter_turns` * 90 degrees (any integer; negative is counter-clockwise). O(bits).
  [[nodiscard]] std::uint64_t turned(std::uint64_t code, int quarter_turns) const;

  /// The smallest Hamming distance between `a` and the four rotations of `b` (eq. 2.15 of the same report).
  /// Symmetric.
  [[nodiscard]] int min_rotational_distance(std::uint64_t a, std::uint64_t b) const;

 private:
  std::vector<int>
      source_shift_;  ///< for each bit of the rotated code, least significant first: its source bit
};

/// The smallest distance between two codes of the family in any of the four relative rotations, and between a
/// code and its rotations by 90, 180 and 270 degrees. The latter keep the orientation of a tag unambiguous.
/// The result is exact; the families with tens of thousands of codes take a second or two (Norouzi, Punjani
/// and Fleet, "Fast search in Hamming space with multi-index hashing", CVPR 2012). `cancelled` is polled;
/// after it returns true, the function returns soon with a meaningless result.
[[nodiscard]] int minimum_distance(
    const Family& family, const std::function<bool()>& cancelled = [] { return false; });

}  // namespace waymark
