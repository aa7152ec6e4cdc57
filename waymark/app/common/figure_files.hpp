#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "waymark/plot/figure.hpp"

namespace waymark {

/// Draws a figure and writes it beside `path` with each suffix (".svg", ".png"); their paths are added to
/// `files`.
[[nodiscard]] Status write_figure(const std::filesystem::path& path, const plot::Figure& figure,
                                  const std::vector<std::string>& suffixes, std::vector<std::string>& files);

}  // namespace waymark
