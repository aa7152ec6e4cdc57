#pragma once

#include <cstdint>
#include <span>

#include "waymark/families/family.hpp"

namespace waymark::web {

/// A Family as stored in the script.
struct FamilyTableRow {
  FamilyId id;
  int width_at_border;
  int total_width;
  bool reversed_border;
  int min_hamming;
  std::span<const BitCell> bits;
  std::span<const std::uint64_t> codes;
};

}  // namespace waymark::web
