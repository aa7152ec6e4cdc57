#include "waymark/app/common/shell_word.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace waymark {

std::string shell_word(const std::string& text) {
  constexpr std::string_view kPlain = "_-./:=,+@%";
  const auto plain = [&](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || kPlain.find(c) != std::string_view::npos;
  };
  if (!text.empty() && std::ranges::all_of(text, plain)) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

}  // namespace waymark
