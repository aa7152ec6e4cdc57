#include "waymark/config/yaml_write.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

namespace waymark {

std::string yaml_number(double value) {
  assert(std::isfinite(value));
  std::string text = fmt::format("{}", value);
  if (text.find('.') != std::string::npos) return text;
  const std::size_t exponent = text.find('e');
  // PyYAML takes "1e-05" for a word: its numbers have a point.
  text.insert(exponent == std::string::npos ? text.size() : exponent, ".0");
  return text;
}

std::string yaml_text(std::string_view text) {
  constexpr std::array kOtherwise = {"true", "false", "yes", "no", "on", "off", "null", "y", "n"};
  std::string lower;
  bool plain = !text.empty();
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    lower += static_cast<char>(std::tolower(byte));
    plain = plain && (std::isalnum(byte) != 0 || c == '_' || c == '/' || c == '-' || c == '.');
  }
  plain = plain && (std::isalpha(static_cast<unsigned char>(text.front())) != 0 || text.front() == '/') &&
          std::find(kOtherwise.begin(), kOtherwise.end(), lower) == kOtherwise.end();
  if (plain) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (byte < 0x20 || byte == 0x7f) {
      quoted += fmt::format("\\x{:02x}", byte);
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

std::string yaml_list(std::span<const double> values) {
  std::string text = "[";
  for (const double value : values) {
    if (text.size() > 1) text += ", ";
    text += yaml_number(value);
  }
  return text + "]";
}

}  // namespace waymark
