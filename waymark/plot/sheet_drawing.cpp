#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/plot/render.hpp"
#include "waymark/plot/sheet_layout.hpp"
#include "waymark/plot/sheet_marks.hpp"
#include "waymark/plot/tag_outline.hpp"

namespace waymark::plot {
namespace {

/// The name in the middle of its row, or in the middle of what the up mark leaves free when it is long.
void draw_name(const std::string& name, const Box& row, double taken_mm, double baseline_mm,
               std::vector<Shape>& shapes) {
  const double height_mm = row.height_mm * 0.86;
  const bool centred = text_length_mm(name, height_mm, true) <= row.width_mm - 2 * taken_mm;
  const double middle_mm = centred ? row.middle_x_mm() : row.middle_x_mm() + taken_mm / 2;
  const double room_mm = row.width_mm - taken_mm * (centred ? 2 : 1) - 0.5;
  shapes.emplace_back(
      Text{name, {middle_mm, baseline_mm}, height_mm, room_mm, Align::Middle, true, false, kMarkColor});
}

void draw_caption(const PlacedTag& placed, double tag_size_mm, std::vector<Shape>& shapes) {
  const Box& box = placed.caption;
  const double row_mm = box.height_mm * 0.4;
  const Box arrow{box.x_mm, box.y_mm + box.height_mm * 0.06, box.width_mm, row_mm};
  const bool narrow = box.width_mm < 30.0;
  draw_dimension(placed.square.x_mm, placed.square.right_mm(), arrow,
                 (narrow ? "" : "size ") + millimetres(tag_size_mm), shapes);

  const Box& mark = placed.up_mark;
  draw_up_mark(mark, shapes);
  const double up_mm = narrow ? 0.0 : row_mm * 1.3;  // room for the word
  if (!narrow) {
    shapes.emplace_back(Text{"up",
                             {mark.right_mm() + row_mm * 0.12, mark.bottom_mm()},
                             row_mm * 0.7,
                             up_mm,
                             Align::Left,
                             false,
                             false,
                             kMarkColor});
  }
  const Box row{box.x_mm, box.y_mm + box.height_mm * 0.5, box.width_mm, row_mm};
  draw_name(to_string(placed.tag), row, mark.right_mm() - box.x_mm + up_mm + 0.5, mark.bottom_mm(), shapes);
}

/// The sides of the tiles, those between neighbours once.
void draw_cut_lines(const std::vector<PlacedTag>& tags, std::vector<Shape>& shapes) {
  const auto tile_at = [&](double x_mm, double y_mm) {
    return std::any_of(tags.begin(), tags.end(), [&](const PlacedTag& other) {
      return std::abs(other.tile.x_mm - x_mm) < kToleranceMm &&
             std::abs(other.tile.y_mm - y_mm) < kToleranceMm;
    });
  };
  const auto cut = [&](Point from, Point to) {
    shapes.emplace_back(Stroke{{from, to}, 0.1, kFaintColor, {2.0, 1.5}});
  };
  for (const PlacedTag& placed : tags) {
    const Box& tile = placed.tile;
    cut({tile.x_mm, tile.y_mm}, {tile.right_mm(), tile.y_mm});
    cut({tile.x_mm, tile.y_mm}, {tile.x_mm, tile.bottom_mm()});
    if (!tile_at(tile.right_mm(), tile.y_mm))
      cut({tile.right_mm(), tile.y_mm}, {tile.right_mm(), tile.bottom_mm()});
    if (!tile_at(tile.x_mm, tile.bottom_mm()))
      cut({tile.x_mm, tile.bottom_mm()}, {tile.right_mm(), tile.bottom_mm()});
  }
}

}  // namespace

std::vector<Drawing> draw_sheet(const SheetLayout& layout) {
  std::vector<Drawing> pages;
  const std::string name(to_string(layout.family));
  for (std::size_t i = 0; i < layout.pages.size(); ++i) {
    const auto& tags = layout.pages[i];
    Drawing page{layout.paper.width_mm,
                 layout.paper.height_mm,
                 fmt::format("{} tags of {}", name, millimetres(layout.tag_size_mm)),
                 {}};
    page.shapes.emplace_back(Group{"cut-lines"});
    draw_cut_lines(tags, page.shapes);
    for (const PlacedTag& placed : tags) {
      page.shapes.emplace_back(Group{to_string(placed.tag)});
      page.shapes.emplace_back(Fill{outline(tag_cells(placed.tag), placed.cells), kBlack});
      draw_caption(placed, layout.tag_size_mm, page.shapes);
    }
    draw_footer(
        layout.footer,
        fmt::format(
            "{} \u00b7 tag_size_m {} = length of the arrow below a tag \u00b7 {} \u00b7 page {} of {}", name,
            fmt::format("{:g}", layout.tag_size_mm / 1e3), layout.paper.name, i + 1, layout.pages.size()),
        page.shapes);
    pages.push_back(std::move(page));
  }
  return pages;
}

}  // namespace waymark::plot
