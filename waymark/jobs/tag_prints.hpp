#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/plot/board.hpp"
#include "waymark/plot/sheet_layout.hpp"

/// What was drawn of a board or a sheet of tags, and the files it was written to.
namespace waymark {

[[nodiscard]] std::string to_text(const plot::BoardLayout& layout, const std::vector<std::string>& files);
[[nodiscard]] nlohmann::ordered_json to_json(const plot::BoardLayout& layout,
                                             const std::vector<std::string>& files);
[[nodiscard]] std::string to_text(const plot::SheetLayout& layout, const std::vector<std::string>& files);
[[nodiscard]] nlohmann::ordered_json to_json(const plot::SheetLayout& layout,
                                             const std::vector<std::string>& files);

}  // namespace waymark
