#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/plot/figure.hpp"

/// A page of text, tables and figures.
namespace waymark::plot {

/// Text in the head of every page by which pages written by this program are recognised.
inline constexpr std::string_view kPageMark = R"(<meta name="generator" content="Waymark">)";

/// Cells as displayed. The first column contains the row names.
struct PageTable {
  std::string caption{};
  std::vector<std::string> head{};
  std::vector<std::vector<std::string>> rows{};
};

struct PageFigure {
  std::string name{};  ///< a name by which to find it, such as "floor" or "error"
  Figure figure{};
  std::string caption{};
};

struct PageSection {
  std::string title{};
  std::vector<std::string> words{};  ///< one paragraph per entry
  std::vector<PageTable> tables{};
  std::vector<PageFigure> figures{};
};

struct Page {
  std::string title{};
  std::string subtitle{};
  std::vector<PageSection> sections{};
};

/// A self-contained HTML file: figures are inline SVG, and there are no scripts or external resources. It is
/// readable on a phone, in print and in dark mode; text is escaped. The same page always gives the same
/// bytes. Fails if a figure cannot be drawn; the error contains the name of the figure.
[[nodiscard]] Result<std::string> to_html(const Page& page);

}  // namespace waymark::plot
