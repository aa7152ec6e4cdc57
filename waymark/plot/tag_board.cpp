#include "waymark/plot/tag_board.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/plot/tag_outline.hpp"
#include "waymark/plot/tag_sheet.hpp"

namespace waymark::plot {
namespace {

constexpr double kCaptionHeightMm = 15.0;

Paper lying(const Paper& paper, bool wide) {
  return (paper.width_mm > paper.height_mm) == wide ? paper : turned(paper);
}

/// Size of the board for tags of this size, including the gap around it.
Box extent(const BoardOptions& options, double tag_size_mm) {
  const auto side = [&](int count) { return tag_size_mm * (count + (count + 1) * options.spacing); };
  return {0, 0, side(options.columns), side(options.rows)};
}

bool fits_lying(const BoardOptions& options, double tag_size_mm, const Paper& paper) {
  const Box board = extent(options, tag_size_mm);
  const double margins_mm = 2e3 * options.margin_m;
  return board.width_mm <= paper.width_mm - margins_mm + kToleranceMm &&
         board.height_mm <= paper.height_mm - margins_mm - kFooterHeightMm - kCaptionHeightMm + kToleranceMm;
}

/// The paper in the orientation in which the board fits; `nullopt` if it fits in neither.
std::optional<Paper> place_on(const BoardOptions& options, double tag_size_mm, const Paper& paper) {
  for (const bool wide : {false, true}) {
    if (options.orientation == (wide ? Orientation::Portrait : Orientation::Landscape)) continue;
    if (fits_lying(options, tag_size_mm, lying(paper, wide))) return lying(paper, wide);
  }
  return std::nullopt;
}

tl::unexpected<Error> does_not_fit(const BoardOptions& options) {
  const double size_mm = options.tag_size_m * 1e3;
  double fitting_mm = 0.0;
  double failing_mm = size_mm;
  for (int i = 0; i < 60; ++i) {
    const double middle_mm = (fitting_mm + failing_mm) / 2;
    (place_on(options, middle_mm, options.paper) ? fitting_mm : failing_mm) = middle_mm;
  }
  const double largest_mm = std::floor(fitting_mm * 10 + kToleranceMm) / 10;
  std::string hint = largest_mm >= 1.0
                         ? fmt::format("The largest tags that fit are {:g} m wide.", largest_mm / 1e3)
                         : std::string("Not even tags of 1 mm fit: reduce `cols` and `rows`.");
  const auto& papers = known_papers();
  const auto enough = std::find_if(papers.begin(), papers.end(), [&](const Paper& paper) {
    return place_on(options, size_mm, paper).has_value();
  });
  if (enough != papers.end()) hint += fmt::format(" The smallest paper size that fits is {}.", enough->name);
  const Box board = extent(options, size_mm);
  return fail(
      ErrorCode::InvalidArgument,
      fmt::format("{} x {} tags of {} with spacing {:g} need {:.1f} x {:.1f} mm, which does not fit on {}",
                  options.columns, options.rows, millimetres(size_mm), options.spacing, board.width_mm,
                  board.height_mm, options.paper.name),
      {.key = "tag_size_m"}, hint);
}

Status check_family(const BoardOptions& options) {
  const Family& table = family(options.family);
  const auto last = static_cast<std::size_t>(options.first_id) +
                    static_cast<std::size_t>(options.columns * options.rows) - 1;
  if (last >= table.codes.size()) {
    return fail(ErrorCode::InvalidArgument, fmt::format("the board requires tag {} of {}", last, table.name),
                {.key = "family"},
                fmt::format("{} has the numbers 0 to {}.", table.name, table.codes.size() - 1));
  }
  if (options.style == BoardStyle::AprilGrid) {
    if (!table.reversed_border) return {};
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} has data cells in place of the squares of an AprilGrid", table.name),
                {.key = "family"}, "Use tag36h11, or the style 'separate'.");
  }
  // One white cell between the prints of neighbouring tags; tags with an outer border need no more than that.
  const int drawn = table.reversed_border ? table.total_width : table.width_at_border;
  const double least = static_cast<double>(drawn + 1 - table.width_at_border) / table.width_at_border;
  if (options.spacing >= least - 1e-9) return {};
  return fail(ErrorCode::InvalidArgument,
              fmt::format("spacing {:g} leaves less than a white cell between two {} tags", options.spacing,
                          table.name),
              {.key = "spacing"}, fmt::format("Set it to at least {:.3f}.", std::ceil(least * 1000) / 1000));
}

PlacedTag place(const BoardLayout& layout, int column, int row_from_below) {
  const BoardOptions& options = layout.options;
  const Family& table = family(options.family);
  const double size_mm = options.tag_size_m * 1e3;
  const double pitch_mm = size_mm * (1 + options.spacing);
  const double gap_mm = size_mm * options.spacing;
  PlacedTag placed;
  placed.tag = {options.family, options.first_id + row_from_below * options.columns + column};
  placed.square = {layout.board.x_mm + gap_mm + column * pitch_mm,
                   layout.board.bottom_mm() - gap_mm - size_mm - row_from_below * pitch_mm, size_mm, size_mm};
  placed.cells = placed.square;
  if (options.style == BoardStyle::Separate) {
    const double outside_mm =
        size_mm * (table.total_width - table.width_at_border) / (2.0 * table.width_at_border);
    placed.cells = {placed.square.x_mm - outside_mm, placed.square.y_mm - outside_mm,
                    size_mm + 2 * outside_mm, size_mm + 2 * outside_mm};
  }
  return placed;
}

}  // namespace

Result<BoardStyle> parse_board_style(std::string_view text) {
  for (const BoardStyle style : {BoardStyle::AprilGrid, BoardStyle::Separate}) {
    if (text == to_string(style)) return style;
  }
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown board style '{}'", text.substr(0, 60)),
              {.key = "style"}, suggestion(text, {"aprilgrid", "separate"}));
}

std::string_view to_string(BoardStyle style) {
  return style == BoardStyle::AprilGrid ? "aprilgrid" : "separate";
}

Result<BoardLayout> layout_board(const BoardOptions& options) {
  if (const Status size = check_tag_size(options.tag_size_m); !size)
    return tl::unexpected<Error>(size.error());
  if (const Status sane = check_ranges(options); !sane) return tl::unexpected<Error>(sane.error());
  if (const Status readable = check_family(options); !readable)
    return tl::unexpected<Error>(readable.error());
  const double size_mm = options.tag_size_m * 1e3;
  const auto paper = place_on(options, size_mm, options.paper);
  if (!paper) return does_not_fit(options);

  BoardLayout layout{
      options, *paper, extent(options, size_mm), {}, place_footer(*paper, options.margin_m * 1e3), {}};
  const double top_mm = options.margin_m * 1e3;
  const double free_mm = layout.footer.strip.y_mm - top_mm - kCaptionHeightMm - layout.board.height_mm;
  layout.board.x_mm = paper->width_mm / 2 - layout.board.width_mm / 2;
  layout.board.y_mm = top_mm + free_mm / 2;
  layout.caption = {layout.board.x_mm, layout.board.bottom_mm(), layout.board.width_mm, kCaptionHeightMm};
  for (int row = 0; row < options.rows; ++row) {
    for (int column = 0; column < options.columns; ++column)
      layout.tags.push_back(place(layout, column, row));
  }
  return layout;
}

Result<std::string> kalibr_target(const BoardOptions& options) {
  const auto refuse = [](std::string what, std::string hint) {
    return fail(ErrorCode::Unsupported, std::move(what), {}, std::move(hint));
  };
  if (options.style != BoardStyle::AprilGrid)
    return refuse("Kalibr reads only boards whose corner squares touch", "Use the style 'aprilgrid'.");
  if (options.family != FamilyId::Tag36h11)
    return refuse(fmt::format("Kalibr does not read {}", to_string(options.family)), "Use tag36h11.");
  if (options.first_id != 0)
    return refuse(fmt::format("Kalibr counts from tag 0 instead of {}", options.first_id),
                  "Omit `first_id`.");
  return fmt::format("target_type: 'aprilgrid'\ntagCols: {}\ntagRows: {}\ntagSize: {}\ntagSpacing: {}\n",
                     options.columns, options.rows, options.tag_size_m, options.spacing);
}

namespace {

/// The squares that touch the corners of the tags, as a single path without seams between adjacent squares.
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
