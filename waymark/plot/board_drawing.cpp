#include <algorithm>

#include <fmt/format.h>

#include "waymark/plot/board.hpp"
#include "waymark/plot/sheet_marks.hpp"
#include "waymark/plot/tag_outline.hpp"

namespace waymark::plot {
namespace {

/// The squares that touch the tags at their corners; one path, so that they and their neighbours show no
/// seam.
Fill corner_squares(const BoardLayout& layout) {
  const double size_mm = layout.options.tag_size_m * 1e3;
  const double gap_mm = size_mm * layout.options.spacing;
  Fill fill{{}, kBlack};
  for (int row = 0; row <= layout.options.rows; ++row) {
    for (int column = 0; column <= layout.options.columns; ++column) {
      const Box square{layout.board.x_mm + column * (size_mm + gap_mm),
                       layout.board.y_mm + row * (size_mm + gap_mm), gap_mm, gap_mm};
      fill.loops.push_back(filled(square).loops.front());
    }
  }
  return fill;
}

void draw_caption(const BoardLayout& layout, std::vector<Shape>& shapes) {
  const BoardOptions& options = layout.options;
  const Box& box = layout.caption;
  const double size_mm = options.tag_size_m * 1e3;
  shapes.emplace_back(Group{"caption"});
  const Box arrow{box.x_mm, box.y_mm + 1.0, box.width_mm, 3.6};
  const Box& first = layout.tags.front().square;
  draw_dimension(first.x_mm, first.right_mm(), arrow, fmt::format("size {}", millimetres(size_mm)), shapes);

  const double mark_mm = 3.0;
  const double baseline_mm = box.y_mm + 9.0;
  draw_up_mark({box.x_mm, baseline_mm - mark_mm, mark_mm, mark_mm}, shapes);
  shapes.emplace_back(
      Text{"up", {box.x_mm + mark_mm + 0.6, baseline_mm}, 3.0, 6.0, Align::Left, false, false, kMarkColor});
  const double side_mm = mark_mm + 7.0;
  const std::string what =
      fmt::format("{} {} \u00d7 {} \u00b7 {} numbers {} to {} \u00b7 gap {} (spacing {:g})",
                  options.style == BoardStyle::AprilGrid ? "AprilGrid" : "Tags", options.columns,
                  options.rows, std::string(to_string(options.family)), options.first_id,
                  layout.tags.back().tag.number, millimetres(size_mm * options.spacing), options.spacing);
  shapes.emplace_back(Text{what,
                           {box.middle_x_mm(), baseline_mm},
                           3.2,
                           box.width_mm - 2 * side_mm,
                           Align::Middle,
                           true,
                           false,
                           kMarkColor});
  shapes.emplace_back(Text{
      fmt::format("origin: lower left corner of tag {}, x right, y up; numbers run to the right, then up",
                  options.first_id),
      {box.middle_x_mm(), baseline_mm + 4.2},
      2.8,
      box.width_mm,
      Align::Middle,
      false,
      false,
      kFaintColor});
}

}  // namespace

Drawing draw_board(const BoardLayout& layout) {
  const BoardOptions& options = layout.options;
  Drawing page{layout.paper.width_mm,
               layout.paper.height_mm,
               fmt::format("Calibration board, {} x {} tags of {}", options.columns, options.rows,
                           millimetres(options.tag_size_m * 1e3)),
               {}};
  const bool grid = options.style == BoardStyle::AprilGrid;
  Fill black = grid ? corner_squares(layout) : Fill{{}, kBlack};
  for (const PlacedTag& placed : layout.tags) {
    const Cells cells = grid ? two_cell_border(placed.tag) : tag_cells(placed.tag);
    auto loops = outline(cells, placed.cells);
    std::move(loops.begin(), loops.end(), std::back_inserter(black.loops));
  }
  page.shapes.emplace_back(Group{"board"});
  page.shapes.emplace_back(std::move(black));
  draw_caption(layout, page.shapes);
  draw_footer(
      layout.footer,
      fmt::format("tag_size_m {:g} \u00b7 spacing {:g} \u00b7 {} \u00b7 mount it on a flat, stiff plate",
                  options.tag_size_m, options.spacing, options.paper.name),
      page.shapes);
  return page;
}

}  // namespace waymark::plot
