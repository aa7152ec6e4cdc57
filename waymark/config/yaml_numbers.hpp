#pragma once

#include <cmath>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include "waymark/config/yaml_cursor.hpp"

namespace waymark::internal {

/// Farther, larger, faster than this (in SI units) is a slip, and would overflow once it is squared.
inline constexpr double kOutOfProportion = 1e6;

/// Fails when one of the numbers at a place is out of all proportion.
[[nodiscard]] inline Status check_proportion(const YamlCursor& cursor, std::span<const double> values) {
  for (const double value : values) {
    if (std::abs(value) > kOutOfProportion)
      return cursor.fail_here(ErrorCode::InvalidArgument, fmt::format("{} is out of all proportion", value),
                              fmt::format("Numbers here are SI units within {}.", kOutOfProportion));
  }
  return {};
}

/// Numbers of a map, one after the other; the first error is kept.
class Numbers {
 public:
  explicit Numbers(const YamlCursor& cursor) : cursor_(cursor) {}

  double operator()(std::string_view key) {
    const Result<double> value = cursor_.read_at(key, &YamlCursor::number);
    if (!value && status_) status_ = tl::unexpected(value.error());
    if (value && status_) status_ = check_proportion(*cursor_.at(key), {&*value, 1});
    return status_ ? *value : 0;
  }
  /// The same, where the key may be missing.
  double optional(std::string_view key, double fallback) {
    return cursor_.find(key) ? (*this)(key) : fallback;
  }
  /// A number greater than 0.
  double positive(std::string_view key) {
    const double value = (*this)(key);
    if (status_ && !(value > 0))
      status_ = cursor_.at(key)->fail_here(ErrorCode::InvalidArgument, "must be greater than 0");
    return value;
  }
  /// A number greater than 0, and not greater than anything it describes is: else its unit was another one.
  double plausible(std::string_view key, double most, std::string_view unit) {
    const double value = positive(key);
    if (status_ && value > most)
      status_ = cursor_.at(key)->fail_here(
          ErrorCode::InvalidArgument,
          fmt::format("{:g} {} is more than the {:g} that any robot has", value, unit, most),
          fmt::format("The unit is {}.", unit));
    return value;
  }
  double optional_positive(std::string_view key, double fallback) {
    return cursor_.find(key) ? positive(key) : fallback;
  }
  /// A number from low to high.
  double optional_within(std::string_view key, double fallback, double low, double high) {
    const double value = optional(key, fallback);
    if (status_ && !(value >= low && value <= high))
      status_ = cursor_.at(key)->fail_here(ErrorCode::InvalidArgument,
                                           fmt::format("must be from {} to {}", low, high));
    return value;
  }
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  const YamlCursor& cursor_;
  Status status_;
};

}  // namespace waymark::internal
