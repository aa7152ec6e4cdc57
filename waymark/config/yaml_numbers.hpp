#pragma once

#include <string_view>

#include "waymark/config/yaml_cursor.hpp"

namespace waymark::internal {

/// Numbers of a map, one after the other; the first error is kept.
class Numbers {
 public:
  explicit Numbers(const YamlCursor& cursor) : cursor_(cursor) {}

  double operator()(std::string_view key) {
    const Result<double> value = cursor_.read_at(key, &YamlCursor::number);
    if (!value && status_) status_ = tl::unexpected(value.error());
    return value.value_or(0);
  }
  /// A number greater than 0.
  double positive(std::string_view key) {
    const double value = (*this)(key);
    if (status_ && !(value > 0))
      status_ = cursor_.at(key)->fail_here(ErrorCode::InvalidArgument, "must be greater than 0");
    return value;
  }
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  const YamlCursor& cursor_;
  Status status_;
};

}  // namespace waymark::internal
