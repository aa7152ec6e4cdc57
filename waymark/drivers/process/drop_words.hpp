#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace waymark {

/// What people are told when the `count`th message of a topic was dropped: of the 1st, 3rd, 10th, 30th, …;
/// else nothing.
[[nodiscard]] std::string drop_words(std::uint64_t count, std::string_view topic, std::string_view why);

}  // namespace waymark
