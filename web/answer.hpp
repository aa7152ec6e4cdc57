#pragma once

#include <string>

#include <fmt/format.h>
#include <Eigen/Core>

namespace waymark::web {

/// A result for JavaScript: text that is valid until the next call.
[[nodiscard]] inline const char* keep(std::string text) {
  static std::string kept;
  kept = std::move(text);
  return kept.c_str();
}

/// Text as a JSON string; error messages may quote user input.
[[nodiscard]] inline std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + '"';
}

/// [[x, y], …]
template <class Points>
[[nodiscard]] std::string points(const Points& all) {
  std::string out;
  for (const auto& p : all) out += fmt::format("{}[{:.9g},{:.9g}]", out.empty() ? "" : ",", p.x(), p.y());
  return '[' + out + ']';
}

}  // namespace waymark::web
