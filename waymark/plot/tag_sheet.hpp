#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/families/family.hpp"
#include "waymark/plot/drawing.hpp"

namespace waymark::plot {

/// A sheet of paper in portrait orientation (the first side is the width).
struct Paper {
  std::string name;      ///< such as "A4"; "300x400" for a custom size
  double width_mm = 0;   ///< [mm]
  double height_mm = 0;  ///< [mm]

  friend bool operator==(const Paper&, const Paper&) = default;
};

/// A6 to A0 (ISO 216), Letter, Legal and Tabloid (ANSI/ASME Y14.1), sorted by increasing area.
[[nodiscard]] const std::vector<Paper>& known_papers();

/// A name from known_papers() (case-insensitive), or a custom size WIDTHxHEIGHT in millimetres ("300x400",
/// "300x400mm") with sides from 20 mm to 5 m. Error: InvalidArgument, suggesting the nearest name.
[[nodiscard]] Result<Paper> parse_paper(std::string_view text);

/// The same sheet rotated by 90 degrees.
[[nodiscard]] inline Paper turned(const Paper& paper) {
  return {paper.name, paper.height_mm, paper.width_mm};
}

/// Orientation of the paper. Auto selects portrait, or landscape if more tags fit (or tags only fit) that
/// way.
enum class Orientation { Auto, Portrait, Landscape };

/// "auto", "portrait" or "landscape". Error: InvalidArgument with a suggestion.
[[nodiscard]] Result<Orientation> parse_orientation(std::string_view text);

/// Whether a tag of this size can be printed; the hint covers sizes specified in millimetres, missing sizes
/// and NaN.
[[nodiscard]] Status check_tag_size(double tag_size_m);

/// Options for a sheet of tags. The "size" of a tag is the side length of the square where its black border
/// meets the white one. Families with an inner border (circle, custom, standard) extend beyond it.
struct SheetOptions {
  double tag_size_m = 0.0;
  Paper paper = {"A4", 210, 297};
  Orientation orientation = Orientation::Auto;
  double margin_m = 0.005;
  int per_page = 0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.tag_size_m,
          Field{"tag_size_m", "Side of the square where the black border meets the white one, in metres.",
                0.001, 5});
    visit(
        self.margin_m,
        Field{"margin_m", "Width of the paper's edge that the printer cannot print on, in metres.", 0, 0.1});
    visit(self.per_page, Field{"per_page", "Number of tags on a page; 0: as many as fit.", 0, 10000});
  }
};

/// A tag on the page and its surroundings.
struct PlacedTag {
  TagId tag;
  Box square;   ///< the square that defines its size, where the black border meets the white one
  Box cells;    ///< all of its cells, total_width x total_width
  Box tile;     ///< the area to cut out, with cells, white margin and caption
  Box caption;  ///< below the cells, with a dimension arrow, then up mark and name
  Box up_mark;  ///< within the caption, a triangle that points to the upper edge of the tag
};

/// The bottom strip of a page, with a ruler, printing instructions and the contents of the page.
struct Footer {
  Box strip;
  Box ruler;  ///< the ruler bar, as wide as its nominal length (100 mm, or less on small paper)
};

/// A print job, in millimetres. Nothing overlaps, and all ink stays within the margins.
struct SheetLayout {
  Paper paper;  ///< in the orientation used
  FamilyId family = FamilyId::Tag36h11;
  double tag_size_mm = 0;
  double margin_mm = 0;
  int tags_per_page = 0;
  Footer footer;  ///< the same on every page
  std::vector<std::vector<PlacedTag>> pages;
};

/// Lays out the tags with these numbers in order, row by row and page by page. Pure; O(numbers). Errors:
/// InvalidArgument for an invalid size, a duplicate number, or a number that the family does not have. Also
/// if a tag or per_page does not fit; the hint contains the largest tag size and the smallest paper size that
/// fit. LimitExceeded for more than 2000 pages.
[[nodiscard]] Result<SheetLayout> layout_sheet(FamilyId family, const std::vector<int>& numbers,
                                               const SheetOptions& options);

/// The largest tag_size_m, to a tenth of a millimetre, for which at least one tag (or options.per_page tags)
/// fits on a page; `nullopt` if not even 1 mm fits. Ignores options.tag_size_m.
[[nodiscard]] std::optional<double> largest_tag_size_m(FamilyId family, const SheetOptions& options);

/// Draws the pages of a layout.
[[nodiscard]] std::vector<Drawing> draw_sheet(const SheetLayout& layout);

inline constexpr Color kMarkColor{0.25, 0.25, 0.25};   ///< for text, arrows and the ruler
inline constexpr Color kFaintColor{0.55, 0.55, 0.55};  ///< for cut lines and side notes

/// Rounding tolerance when comparing lengths.
inline constexpr double kToleranceMm = 1e-6;

/// Rounds to a hundredth: 160 -> "160 mm", 24.69 -> "24.69 mm".
[[nodiscard]] std::string millimetres(double length_mm);

/// Height of the footer strip, and its position on a page.
inline constexpr double kFooterHeightMm = 15.0;
[[nodiscard]] Footer place_footer(const Paper& paper, double margin_mm);

/// Draws the ruler with its ticks and text; `remark` is the last line.
void draw_footer(const Footer& footer, const std::string& remark, std::vector<Shape>& shapes);

/// Draws an arrow between the x positions `from_mm` and `to_mm` inside a strip, with text in its middle. The
/// text is placed to the right of the arrow if it would otherwise be too small and the strip has enough room.
void draw_dimension(double from_mm, double to_mm, const Box& strip, const std::string& words,
                    std::vector<Shape>& shapes);

/// Draws a triangle that fills the box and points to the upper edge.
void draw_up_mark(const Box& box, std::vector<Shape>& shapes);

}  // namespace waymark::plot
