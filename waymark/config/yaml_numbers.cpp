#include "waymark/config/yaml_numbers.hpp"

#include <cmath>

#include <fmt/format.h>

namespace waymark::internal {

Status check_proportion(const YamlCursor& cursor, std::span<const double> values) {
  for (const double value : values) {
    if (std::abs(value) > kOutOfProportion)
      return cursor.fail_here(ErrorCode::InvalidArgument, fmt::format("{} is out of all proportion", value),
                              fmt::format("Numbers here are SI units within {}.", kOutOfProportion));
  }
  return {};
}

double Numbers::operator()(std::string_view key) {
  const Result<double> value = cursor_.read_at(key, &YamlCursor::number);
  if (!value && status_) status_ = tl::unexpected(value.error());
  if (value && status_) status_ = check_proportion(*cursor_.at(key), {&*value, 1});
  return status_ ? *value : 0;
}

double Numbers::optional(std::string_view key, double fallback) {
  return cursor_.find(key) ? (*this)(key) : fallback;
}

double Numbers::positive(std::string_view key) {
  const double value = (*this)(key);
  if (status_ && !(value > 0))
    status_ = cursor_.at(key)->fail_here(ErrorCode::InvalidArgument, "must be greater than 0");
  return value;
}

double Numbers::plausible(std::string_view key, double most, std::string_view unit) {
  const double value = positive(key);
  if (status_ && value > most)
    status_ = cursor_.at(key)->fail_here(
        ErrorCode::InvalidArgument,
        fmt::format("{:g} {} is more than the {:g} that any robot has", value, unit, most),
        fmt::format("The unit is {}.", unit));
  return value;
}

double Numbers::optional_positive(std::string_view key, double fallback) {
  return cursor_.find(key) ? positive(key) : fallback;
}

double Numbers::optional_within(std::string_view key, double fallback, double low, double high) {
  const double value = optional(key, fallback);
  if (status_ && !(value >= low && value <= high))
    status_ = cursor_.at(key)->fail_here(ErrorCode::InvalidArgument,
                                         fmt::format("must be from {} to {}", low, high));
  return value;
}

}  // namespace waymark::internal
