#pragma once

#include <cstddef>

namespace waymark::render {

/// Where (row, column) stands in an array of rows of `width`. None of them may be negative.
[[nodiscard]] constexpr std::size_t row_major(int row, int width, int column = 0) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
}

}  // namespace waymark::render
