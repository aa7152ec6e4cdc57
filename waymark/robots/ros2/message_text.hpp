#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

namespace waymark {

/// The fields of a message in plain little-endian CDR as lines "name: value", indented as `ros2 topic echo`
/// has them; of lists longer than `most_elements` the first ones and their number. Fails on a type whose
/// definition is not known here, and on bytes that end too early.
[[nodiscard]] Result<std::string> message_text(std::string_view type, std::span<const std::uint8_t> cdr,
                                               std::size_t most_elements = 12);

}  // namespace waymark
