#include "waymark/base/fields.hpp"

#include <fmt/format.h>

namespace waymark {

tl::unexpected<Error> outside_range(double number, const Field& field) {
  return fail(ErrorCode::InvalidArgument, fmt::format("{} is outside [{}, {}]", number, field.min, field.max),
              {.key = std::string(field.name)}, std::string(field.sentence));
}

}  // namespace waymark
