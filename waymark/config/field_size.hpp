#pragma once

#include <optional>
#include <string_view>

namespace waymark {

/// Length (along x) and width of a field, as layouts of WPILib and field maps of Limelight state it.
struct FieldSize {
  double length_m = 0;
  double width_m = 0;

  friend bool operator==(const FieldSize&, const FieldSize&) = default;
};

/// Of a layout of WPILib or a field map of Limelight (JSON). Nothing where it states none, or one that is not
/// greater than 0.
[[nodiscard]] std::optional<FieldSize> field_size_of(std::string_view json);

}  // namespace waymark
