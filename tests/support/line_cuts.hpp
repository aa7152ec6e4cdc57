#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace waymark::testing {

/// The text cut at each end of a line, from nothing to everything but the last line.
inline std::vector<std::string> cuts_at_line_ends(std::string_view text) {
  std::vector<std::string> cuts = {""};
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    if (text[i] == '\n') cuts.emplace_back(text.substr(0, i + 1));
  }
  return cuts;
}

}  // namespace waymark::testing
