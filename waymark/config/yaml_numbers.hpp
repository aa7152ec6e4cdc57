#pragma once

#include <span>
#include <string_view>

#include "waymark/config/yaml_cursor.hpp"

namespace waymark::internal {

/// Farther, larger, faster than this (in SI units) is a slip, and would overflow once it is squared.
inline constexpr double kOutOfProportion = 1e6;

/// Fails when one of the numbers at a place is out of all proportion.
[[nodiscard]] Status check_proportion(const YamlCursor& cursor, std::span<const double> values);

/// Numbers of a map, one after the other; the first error is kept.
class Numbers {
 public:
  explicit Numbers(const YamlCursor& cursor) : cursor_(cursor) {}

  double operator()(std::string_view key);
  /// The same, where the key may be missing.
  double optional(std::string_view key, double fallback);
  /// A number greater than 0.
  double positive(std::string_view key);
  /// A number greater than 0, and not greater than anything it describes is: else its unit was another one.
  double plausible(std::string_view key, double most, std::string_view unit);
  double optional_positive(std::string_view key, double fallback);
  /// A number from low to high.
  double optional_within(std::string_view key, double fallback, double low, double high);
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  const YamlCursor& cursor_;
  Status status_;
};

}  // namespace waymark::internal
