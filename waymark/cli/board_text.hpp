#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/plot/board.hpp"

namespace waymark::cli {

/// What was drawn, and the files it was written to.
[[nodiscard]] std::string to_text(const plot::BoardLayout& layout, const std::vector<std::string>& files);
[[nodiscard]] nlohmann::ordered_json to_json(const plot::BoardLayout& layout,
                                             const std::vector<std::string>& files);

}  // namespace waymark::cli
