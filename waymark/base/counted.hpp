#pragma once

#include <concepts>
#include <string>

namespace waymark {

/// "1 picture", "0 pictures", "12 pictures": how many of a thing, whose plural has an s.
template <std::integral Number>
[[nodiscard]] std::string counted(Number number, const char* thing) {
  return std::to_string(number) + " " + thing + (number == 1 ? "" : "s");
}

}  // namespace waymark
