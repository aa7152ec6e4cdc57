#include "waymark/plot/square_board.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "waymark/plot/tag_sheet.hpp"

namespace waymark::plot {
namespace {

constexpr double kSquareCaptionHeightMm = 8.0;
constexpr int kMaxBoardPages = 400;

double square_mm(const SquareBoardOptions& options) { return 1e3 * options.board.size_m; }

/// The printable area of the paper above the caption.
Box printable(const SquareBoardOptions& options, const Paper& paper) {
  const double margin_mm = 1e3 * options.margin_m;
  return {margin_mm, margin_mm, paper.width_mm - 2 * margin_mm,
          paper.height_mm - 2 * margin_mm - kFooterHeightMm - kSquareCaptionHeightMm};
}

/// Number of squares of this size that fit into a length.
int fitting(double length_mm, double square_mm) {
  return static_cast<int>(std::min(1e3, std::floor((length_mm + kToleranceMm) / square_mm)));
}

int pages_for(int squares, int a_page) {
  return a_page < 1 ? std::numeric_limits<int>::max() : (squares + a_page - 1) / a_page;
}

std::vector<Paper> orientations(const SquareBoardOptions& options) {
  std::vector<Paper> papers;
  for (const bool wide : {false, true}) {
    if (options.orientation == (wide ? Orientation::Portrait : Orientation::Landscape)) continue;
    const bool lies_wide = options.paper.width_mm > options.paper.height_mm;
    papers.push_back(lies_wide == wide ? options.paper : turned(options.paper));
  }
  return papers;
}

struct Split {
  Paper paper;
  int across = std::numeric_limits<int>::max();
  int down = std::numeric_limits<int>::max();

  [[nodiscard]] double pages() const { return static_cast<double>(across) * down; }
};

/// The orientation of the paper that needs the fewest pages.
Split split_of(const SquareBoardOptions& options, double square_mm) {
  Split best;
  for (const Paper& paper : orientations(options)) {
    const Box room = printable(options, paper);
    const Split split{paper, pages_for(options.board.columns, fitting(room.width_mm, square_mm)),
                      pages_for(options.board.rows, fitting(room.height_mm, square_mm))};
    if (best.paper.name.empty() || split.pages() < best.pages()) best = split;
  }
  return best;
}

tl::unexpected<Error> squares_do_not_fit(const SquareBoardOptions& options) {
  double fitting_mm = 0;
  double failing_mm = square_mm(options);
  const double most_pages = options.tiled ? kMaxBoardPages : 1;
  for (int i = 0; i < 60; ++i) {
    const double middle_mm = (fitting_mm + failing_mm) / 2;
    (split_of(options, middle_mm).pages() <= most_pages ? fitting_mm : failing_mm) = middle_mm;
  }
  const std::string largest = fmt::format("The largest squares that fit are {:g} m wide",
                                          std::floor(10 * fitting_mm + kToleranceMm) / 1e4);
  return fail(ErrorCode::InvalidArgument,
              fmt::format("{} x {} squares of {} do not fit on {}{}", options.board.columns,
                          options.board.rows, millimetres(square_mm(options)),
                          options.tiled ? fmt::format("{} pages of ", kMaxBoardPages) : std::string(),
                          options.paper.name),
              {.key = "square_size_m"},
              largest + (options.tiled ? "; or use larger paper (`paper`)."
                                       : "; or distribute the board over several pages (`tiled`)."));
}

/// The number of squares on each page, divided as equally as possible.
std::vector<std::pair<int, int>> shares(int squares, int pages) {
  std::vector<std::pair<int, int>> all;
  for (int page = 0; page < pages; ++page) {
    const int from = squares * page / pages;
    all.emplace_back(from, squares * (page + 1) / pages - from);
  }
  return all;
}

void draw_squares(const SquareBoardLayout& layout, const SquareBoardPage& page, std::vector<Shape>& shapes) {
  const CalibrationBoard& board = layout.options.board;
  const double side_mm = square_mm(layout.options);
  const std::vector<BoardMarker> markers = board_markers(board);
  Fill black{{}, kBlack};
  std::size_t marker = 0;
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      const bool is_black = is_black_square(board, column, row);
      const std::size_t own = is_black || markers.empty() ? marker : marker++;
      const int x = column - page.first_column;
      const int y = row - page.first_row;
      if (x < 0 || y < 0 || x >= page.columns || y >= page.rows) continue;
      const Box square{page.area.x_mm + x * side_mm, page.area.y_mm + y * side_mm, side_mm, side_mm};
      if (is_black) {
        black.loops.push_back(filled(square).loops.front());
      } else if (!markers.empty()) {
        const double inner_mm = 1e3 * board.marker_m;
        auto loops = outline(
            layout.options.markers.at(own),
            {square.middle_x_mm() - inner_mm / 2, square.middle_y_mm() - inner_mm / 2, inner_mm, inner_mm});
        std::move(loops.begin(), loops.end(), std::back_inserter(black.loops));
      }
    }
  }
  shapes.emplace_back(Group{"board"});
  shapes.emplace_back(std::move(black));
}

void draw_cross(const Point& at, std::vector<Shape>& shapes) {
  constexpr double kArmMm = 2.5;
  shapes.emplace_back(
      Stroke{{{at.x_mm - kArmMm, at.y_mm}, {at.x_mm + kArmMm, at.y_mm}}, 0.1, kMarkColor, {}});
  shapes.emplace_back(
      Stroke{{{at.x_mm, at.y_mm - kArmMm}, {at.x_mm, at.y_mm + kArmMm}}, 0.1, kMarkColor, {}});
}

void draw_joins(const SquareBoardLayout& layout, const SquareBoardPage& page, std::vector<Shape>& shapes) {
  const Box& area = page.area;
  const auto join = [&](const Point& from, const Point& to) {
    shapes.emplace_back(Stroke{{from, to}, 0.1, kFaintColor, {2, 1}});
    draw_cross(from, shapes);
    draw_cross(to, shapes);
  };
  shapes.emplace_back(Group{"joins"});
  const Point top_left{area.x_mm, area.y_mm};
  const Point top_right{area.right_mm(), area.y_mm};
  const Point bottom_left{area.x_mm, area.bottom_mm()};
  const Point bottom_right{area.right_mm(), area.bottom_mm()};
  if (page.first_column > 0) join(top_left, bottom_left);
  if (page.first_column + page.columns < layout.options.board.columns) join(top_right, bottom_right);
  if (page.first_row > 0) join(top_left, top_right);
  if (page.first_row + page.rows < layout.options.board.rows) join(bottom_left, bottom_right);
}

std::string to_text(const SquareBoardOptions& options) {
  const CalibrationBoard& board = options.board;
  std::string words = fmt::format("{} {} \u00d7 {} squares of {}", to_string(board.kind), board.columns,
                                  board.rows, millimetres(square_mm(options)));
  if (board.kind == BoardKind::Charuco)
    words += fmt::format(" \u00b7 markers {} of {}{}", board.dictionary, millimetres(1e3 * board.marker_m),
                         board.legacy_pattern ? " \u00b7 legacy pattern" : "");
  return words;
}

}  // namespace

Result<SquareBoardLayout> layout_square_board(const SquareBoardOptions& options) {
  if (Status usable = check_board(options.board); !usable) return tl::unexpected(usable.error());
  if (options.board.kind == BoardKind::AprilGrid ||
      options.markers.size() != board_markers(options.board).size())
    return fail(ErrorCode::InvalidArgument, "not a board of squares with all its markers");
  const Split split = split_of(options, square_mm(options));
  if ((!options.tiled && split.pages() > 1) || split.pages() > kMaxBoardPages)
    return squares_do_not_fit(options);
  SquareBoardLayout layout{options,      split.paper, place_footer(split.paper, 1e3 * options.margin_m),
                           split.across, split.down,  {}};
  const Box room = printable(options, split.paper);
  for (const auto& [row, rows] : shares(options.board.rows, split.down)) {
    for (const auto& [column, columns] : shares(options.board.columns, split.across)) {
      const double width_mm = columns * square_mm(options);
      const double height_mm = rows * square_mm(options);
      layout.pages.push_back({column,
                              row,
                              columns,
                              rows,
                              {room.x_mm + (room.width_mm - width_mm) / 2,
                               room.y_mm + (room.height_mm - height_mm) / 2, width_mm, height_mm}});
    }
  }
  return layout;
}

std::vector<Drawing> draw_square_board(const SquareBoardLayout& layout) {
  std::vector<Drawing> drawings;
  const std::string words = to_text(layout.options);
  for (std::size_t i = 0; i < layout.pages.size(); ++i) {
    const SquareBoardPage& page = layout.pages[i];
    Drawing drawing{layout.paper.width_mm, layout.paper.height_mm, "Calibration board, " + words, {}};
    draw_squares(layout, page, drawing.shapes);
    if (layout.pages.size() > 1) draw_joins(layout, page, drawing.shapes);
    const auto across = static_cast<std::size_t>(layout.across);
    const std::string place =
        layout.pages.size() == 1
            ? std::string()
            : fmt::format(" \u00b7 page {} of {}: row {} of {}, column {} of {}; cut along the dashed lines",
                          i + 1, layout.pages.size(), i / across + 1, layout.down, i % across + 1,
                          layout.across);
    drawing.shapes.emplace_back(Group{"caption"});
    drawing.shapes.emplace_back(Text{words + place,
                                     {layout.paper.width_mm / 2, layout.footer.strip.y_mm - 2},
                                     3.2,
                                     layout.footer.strip.width_mm,
                                     Align::Middle,
                                     true,
                                     false,
                                     kMarkColor});
    draw_footer(layout.footer,
                fmt::format("square_size_m {:g} \u00b7 {} \u00b7 mount it on a flat, stiff plate",
                            layout.options.board.size_m, layout.paper.name),
                drawing.shapes);
    drawings.push_back(std::move(drawing));
  }
  return drawings;
}

}  // namespace waymark::plot
