#include "waymark/config/yaml_fields.hpp"

#include <fmt/format.h>

namespace waymark::internal {

Status check_range(const YamlCursor& cursor, double value, const Field& field) {
  if (value >= field.min && value <= field.max) return {};
  return cursor.fail_here(ErrorCode::InvalidArgument,
                          fmt::format("{} is outside [{}, {}]", value, field.min, field.max),
                          std::string(field.sentence));
}

}  // namespace waymark::internal
