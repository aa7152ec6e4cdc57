#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace waymark {

/// The value below which a fraction `share` (0 to 1) of the values lies. It is one of the values, without
/// interpolation; T{} for an empty list. O(n).
template <class T>
[[nodiscard]] T quantile(std::vector<T> values, double share) {
  if (values.empty()) return T{};
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, values.begin() + rank);
  return values[static_cast<std::size_t>(rank)];
}

/// The median; for an even number of values, the upper of the two middle values. T{} for an empty list. O(n).
template <class T>
[[nodiscard]] T median(std::vector<T> values) {
  if (values.empty()) return T{};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace waymark
