#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/plot/figure.hpp"

/// A page to read: words, tables and figures.
namespace waymark::plot {

/// Stands in the head of every page, so that one is known again.
inline constexpr std::string_view kPageMark = R"(<meta name="generator" content="Waymark">)";

/// Cells as they are shown. The first column names the row.
struct PageTable {
  std::string caption{};
  std::vector<std::string> head{};
  std::vector<std::vector<std::string>> rows{};
};

struct PageFigure {
  std::string name{};  ///< a word to find it by: "floor", "error"
  Figure figure{};
  std::string caption{};
};

struct PageSection {
  std::string title{};
  std::vector<std::string> words{};  ///< a paragraph each
  std::vector<PageTable> tables{};
  std::vector<PageFigure> figures{};
};

struct Page {
  std::string title{};
  std::string subtitle{};
  std::vector<PageSection> sections{};
};

/// One HTML file with nothing outside it: figures are drawn inside (SVG), there is no script, and it loads
/// nothing. Readable on a phone, on paper and in the dark; words are escaped. Same page, same bytes. Fails
/// when a figure cannot be drawn, and names it.
[[nodiscard]] Result<std::string> to_html(const Page& page);

}  // namespace waymark::plot
