#include "waymark/plot/sheet_layout.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/plot/sheet_marks.hpp"

namespace waymark::plot {
namespace {

constexpr std::size_t kMostPages = 2000;
constexpr double kNarrowestTileMm = 18.0;  // so that the caption of a small tag can be read

/// The measures of one tile, the same for all tags of a family and size.
struct Tile {
  double cells_mm = 0;   ///< side of all cells
  double border_mm = 0;  ///< from the edge of the cells to the border square
  double white_mm = 0;   ///< white margin around the cells
  double width_mm = 0;
  double height_mm = 0;
  double caption_mm = 0;  ///< height
};

Tile tile_of(const Family& family, double tag_size_mm) {
  const double cell_mm = tag_size_mm / family.width_at_border;
  Tile tile;
  tile.cells_mm = cell_mm * family.total_width;
  tile.border_mm = cell_mm * (family.total_width - family.width_at_border) / 2;
  // The cells of families with an outer border already contain the white ring they need. The others end in
  // data cells, and half a cell of paper keeps the scissors off them.
  tile.white_mm = family.reversed_border ? cell_mm / 2 : 0.0;
  tile.caption_mm = std::clamp(0.12 * tag_size_mm, 7.5, 16.0);
  tile.width_mm = std::max(tile.cells_mm + 2 * tile.white_mm, kNarrowestTileMm);
  tile.height_mm = tile.cells_mm + 2 * tile.white_mm + tile.caption_mm;
  return tile;
}

struct Grid {
  Paper paper;  ///< as it lies
  int columns = 0;
  int rows = 0;

  [[nodiscard]] int capacity() const { return columns * rows; }
};

int how_often(double length_mm, double room_mm) {
  return std::max(0, static_cast<int>(std::floor((room_mm + kToleranceMm) / length_mm)));
}

/// The largest grid of tiles on a sheet that lies as it is.
Grid grid_on(const Paper& paper, const Tile& tile, double margin_mm) {
  return {paper, how_often(tile.width_mm, paper.width_mm - 2 * margin_mm),
          how_often(tile.height_mm, paper.height_mm - 2 * margin_mm - kFooterHeightMm)};
}

/// The grid on the paper, turned if that is allowed and of use for `wanted` tags (0: as many as can be).
Grid best_grid(const Paper& paper, const Tile& tile, double margin_mm, Orientation orientation, int wanted) {
  const bool upright = paper.width_mm <= paper.height_mm;
  const Paper portrait = upright ? paper : turned(paper);
  Grid tall = grid_on(portrait, tile, margin_mm);
  Grid wide = grid_on(turned(portrait), tile, margin_mm);
  if (orientation == Orientation::Portrait) return tall;
  if (orientation == Orientation::Landscape) return wide;
  if (wanted > 0 && tall.capacity() >= wanted) return tall;
  return wide.capacity() > tall.capacity() ? wide : tall;
}

bool fits(const Family& family, double tag_size_mm, const Paper& paper, const SheetOptions& options) {
  const int wanted = std::max(1, options.per_page);
  const Tile tile = tile_of(family, tag_size_mm);
  return best_grid(paper, tile, options.margin_m * 1e3, options.orientation, wanted).capacity() >= wanted;
}

tl::unexpected<Error> does_not_fit(const Family& family, const SheetOptions& options) {
  const double size_mm = options.tag_size_m * 1e3;
  const std::string what =
      options.per_page > 1 ? fmt::format("{} {} tags of {} do not fit on one page of {}", options.per_page,
                                         family.name, millimetres(size_mm), options.paper.name)
                           : fmt::format("a {} tag of {} does not fit on {}", family.name,
                                         millimetres(size_mm), options.paper.name);
  const auto largest_m = largest_tag_size_m(family.id, options);
  std::string hint =
      largest_m ? fmt::format("The largest size that does: {:g} m.", *largest_m) : "No tag fits on it.";
  const auto& papers = known_papers();
  const auto enough = std::find_if(papers.begin(), papers.end(),
                                   [&](const Paper& paper) { return fits(family, size_mm, paper, options); });
  if (enough != papers.end()) {
    hint += fmt::format(" The smallest paper that would do: {}.", enough->name);
  }
  return fail(ErrorCode::InvalidArgument, what, {.key = options.per_page > 1 ? "per_page" : "tag_size_m"},
              hint);
}

Status check_numbers(const Family& family, const std::vector<int>& numbers) {
  if (numbers.empty())
    return fail(ErrorCode::InvalidArgument, "no tags to draw", {.key = "ids"}, "Name some, as in 0-3,7.");
  std::set<int> seen;
  for (const int number : numbers) {
    if (number < 0 || static_cast<std::size_t>(number) >= family.codes.size()) {
      return fail(ErrorCode::InvalidArgument, fmt::format("no tag number {} in {}", number, family.name),
                  {.key = "ids"},
                  fmt::format("{} has the numbers 0 to {}.", family.name, family.codes.size() - 1));
    }
    if (!seen.insert(number).second) {
      return fail(ErrorCode::InvalidArgument, fmt::format("tag number {} is named twice", number),
                  {.key = "ids"}, "A tag says where it is: each number can stand in one place only.");
    }
  }
  return {};
}

/// Only as many columns and rows as the tags need.
Grid shrunk_to(Grid grid, int wanted) {
  grid.columns = std::min(grid.columns, wanted);
  grid.rows = (wanted + grid.columns - 1) / grid.columns;
  return grid;
}

PlacedTag place(const TagId& tag, const Tile& tile, double tag_size_mm, Point corner) {
  PlacedTag placed;
  placed.tag = tag;
  placed.tile = {corner.x_mm, corner.y_mm, tile.width_mm, tile.height_mm};
  const double cells_x_mm = placed.tile.middle_x_mm() - tile.cells_mm / 2;
  placed.cells = {cells_x_mm, corner.y_mm + tile.white_mm, tile.cells_mm, tile.cells_mm};
  placed.square = {cells_x_mm + tile.border_mm, placed.cells.y_mm + tile.border_mm, tag_size_mm, tag_size_mm};
  placed.caption = {corner.x_mm, placed.tile.bottom_mm() - tile.caption_mm, tile.width_mm, tile.caption_mm};
  const double mark_mm = tile.caption_mm / 4;
  placed.up_mark = {corner.x_mm + std::min(1.5, tile.width_mm * 0.04),
                    placed.tile.bottom_mm() - 0.2 * tile.caption_mm - mark_mm, mark_mm, mark_mm};
  return placed;
}

}  // namespace

Result<Orientation> parse_orientation(std::string_view text) {
  if (text == "auto") return Orientation::Auto;
  if (text == "portrait") return Orientation::Portrait;
  if (text == "landscape") return Orientation::Landscape;
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown orientation '{}'", text.substr(0, 60)),
              {.key = "orientation"}, suggestion(text, {"auto", "portrait", "landscape"}));
}

Status check_tag_size(double tag_size_m) {
  constexpr double kSmallestM = 0.001;
  constexpr double kLargestM = 5.0;
  if (tag_size_m >= kSmallestM && tag_size_m <= kLargestM) return {};
  const bool millimetres_given = tag_size_m > kLargestM && tag_size_m <= kLargestM * 1e3;
  return fail(ErrorCode::InvalidArgument, fmt::format("{} m is no size of a tag to print", tag_size_m),
              {.key = "tag_size_m"},
              millimetres_given
                  ? fmt::format("Sizes are in metres: {:g} mm is {:g}.", tag_size_m, tag_size_m / 1e3)
                  : fmt::format("Give metres, {:g} to {:g}; 160 mm is 0.16.", kSmallestM, kLargestM));
}

std::optional<double> largest_tag_size_m(FamilyId id, const SheetOptions& options) {
  double fitting_mm = 0.0;
  double failing_mm = std::max(options.paper.width_mm, options.paper.height_mm);
  for (int i = 0; i < 60; ++i) {
    const double size_mm = (fitting_mm + failing_mm) / 2;
    (fits(family(id), size_mm, options.paper, options) ? fitting_mm : failing_mm) = size_mm;
  }
  const double rounded_mm = std::floor(fitting_mm * 10 + kToleranceMm) / 10;
  return rounded_mm >= 1.0 ? std::optional(rounded_mm / 1e3) : std::nullopt;
}

Result<SheetLayout> layout_sheet(FamilyId id, const std::vector<int>& numbers, const SheetOptions& options) {
  const Family& table = family(id);
  if (const Status size = check_tag_size(options.tag_size_m); !size)
    return tl::unexpected<Error>(size.error());
  if (const Status sane = check_ranges(options); !sane) return tl::unexpected<Error>(sane.error());
  if (const Status known = check_numbers(table, numbers); !known) return tl::unexpected<Error>(known.error());
  const double size_mm = options.tag_size_m * 1e3;
  const double margin_mm = options.margin_m * 1e3;
  if (!fits(table, size_mm, options.paper, options)) return does_not_fit(table, options);

  const Tile tile = tile_of(table, size_mm);
  Grid grid = best_grid(options.paper, tile, margin_mm, options.orientation, options.per_page);
  const int per_page = options.per_page > 0 ? options.per_page : grid.capacity();
  grid = shrunk_to(grid, std::min(per_page, static_cast<int>(numbers.size())));
  const auto step = static_cast<std::size_t>(per_page);
  if ((numbers.size() + step - 1) / step > kMostPages) {
    return fail(ErrorCode::LimitExceeded,
                fmt::format("{} tags would need more than {} pages", numbers.size(), kMostPages),
                {.key = "ids"}, "Ask for fewer at a time.");
  }

  SheetLayout layout{grid.paper, id, size_mm, margin_mm, per_page, place_footer(grid.paper, margin_mm), {}};
  const double left_mm = grid.paper.width_mm / 2 - grid.columns * tile.width_mm / 2;
  const double top_mm = (margin_mm + layout.footer.strip.y_mm) / 2 - grid.rows * tile.height_mm / 2;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i % step == 0) layout.pages.emplace_back();
    const int column = static_cast<int>(i % step) % grid.columns;
    const int row = static_cast<int>(i % step) / grid.columns;
    const Point corner{left_mm + column * tile.width_mm, top_mm + row * tile.height_mm};
    layout.pages.back().push_back(place({id, numbers[i]}, tile, size_mm, corner));
  }
  return layout;
}

}  // namespace waymark::plot
