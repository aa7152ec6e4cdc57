#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "waymark/families/family.hpp"

namespace waymark::search {

struct NearestCode {
  int number = 0;
  int distance = 0;
};

/// Finds the code of a family within a few wrong bits without a list of all wrong codes: cut into one piece
/// more than there may be wrong bits, one piece must be right (Norouzi, Punjani and Fleet, "Fast search in
/// Hamming space with multi-index hashing", CVPR 2012). Memory is a few words a code.
class CodeIndex {
 public:
  /// `max_distance` from 0 to 3.
  CodeIndex(const Family& family, int max_distance);

  /// The nearest code within max_distance; of equally near ones the lowest number.
  [[nodiscard]] std::optional<NearestCode> find(std::uint64_t code) const;

  /// The code that has these bits where `known` has ones. None where several have. O(codes).
  [[nodiscard]] std::optional<int> find_exact(std::uint64_t code, std::uint64_t known) const;

 private:
  /// Numbers of the codes by the value of one piece of their bits.
  struct Piece {
    unsigned shift = 0;
    std::uint64_t mask = 0;
    std::vector<std::uint32_t> begins;  ///< into numbers, one more than values
    std::vector<std::uint32_t> numbers;
  };

  std::vector<std::uint64_t> codes_;
  std::vector<Piece> pieces_;
  int max_distance_ = 0;
};

}  // namespace waymark::search
