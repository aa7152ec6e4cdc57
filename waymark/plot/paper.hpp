#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark::plot {

/// A sheet of paper, upright (the first side is the width).
struct Paper {
  std::string name;      ///< "A4"; "300x400" for a size of one's own
  double width_mm = 0;   ///< [mm]
  double height_mm = 0;  ///< [mm]

  friend bool operator==(const Paper&, const Paper&) = default;
};

/// A6 to A0 (ISO 216), Letter, Legal and Tabloid (ANSI/ASME Y14.1), from small to large by area.
[[nodiscard]] const std::vector<Paper>& known_papers();

/// A name of known_papers() in any case, or a size of one's own, WIDTHxHEIGHT in millimetres ("300x400",
/// "300x400mm"), 20 mm to 5 m a side. Errors: InvalidArgument, with the nearest name suggested.
[[nodiscard]] Result<Paper> parse_paper(std::string_view text);

/// The same sheet turned by a quarter.
[[nodiscard]] inline Paper turned(const Paper& paper) {
  return {paper.name, paper.height_mm, paper.width_mm};
}

}  // namespace waymark::plot
