#include "waymark/plot/tag_sheet.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/plot/render.hpp"
#include "waymark/plot/tag_outline.hpp"
#include "waymark/plot/text.hpp"

namespace waymark::plot {
namespace {

constexpr double kSmallestSideMm = 20.0;
constexpr double kLargestTagMm = 5000.0;

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

std::optional<double> number(std::string_view text) {
  double value = 0.0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Parses "300x400" or "300x400mm" as two numbers; `nullopt` for any other text.
std::optional<Paper> own_size(std::string_view text) {
  if (text.ends_with("mm")) text.remove_suffix(2);
  const std::size_t cross = text.find('x');
  if (cross == std::string_view::npos) return std::nullopt;
  const auto width_mm = number(text.substr(0, cross));
  const auto height_mm = number(text.substr(cross + 1));
  if (!width_mm || !height_mm) return std::nullopt;
  return Paper{std::string(text), *width_mm, *height_mm};
}

bool sane(double side_mm) { return side_mm >= kSmallestSideMm && side_mm <= kLargestTagMm; }

}  // namespace

const std::vector<Paper>& known_papers() {
  static const std::vector<Paper> papers = {
      {"A6", 105, 148},        {"A5", 148, 210},          {"Letter", 215.9, 279.4}, {"A4", 210, 297},
      {"Legal", 215.9, 355.6}, {"Tabloid", 279.4, 431.8}, {"A3", 297, 420},         {"A2", 420, 594},
      {"A1", 594, 841},        {"A0", 841, 1189},
  };
  return papers;
}

Result<Paper> parse_paper(std::string_view text) {
  const std::string wanted = lower(text.substr(0, 60));
  std::vector<std::string> names;
  for (const Paper& paper : known_papers()) {
    if (lower(paper.name) == wanted) return paper;
    names.push_back(paper.name);
  }
  if (const auto paper = own_size(wanted)) {
    if (sane(paper->width_mm) && sane(paper->height_mm)) return *paper;
    return fail(ErrorCode::InvalidArgument, fmt::format("invalid paper size {} mm", paper->name),
                {.key = "paper"},
                fmt::format("Each side must be {} to {} mm.", kSmallestSideMm, kLargestTagMm));
  }
  std::string hint = suggestion(wanted, names);
  hint += fmt::format("{}Or pass WIDTHxHEIGHT in millimetres, as in 300x400.", hint.empty() ? "" : " ");
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown paper '{}'", text.substr(0, 60)),
              {.key = "paper"}, hint);
}

namespace {

constexpr std::size_t kMaxPages = 2000;
constexpr double kNarrowestTileMm = 18.0;  // keeps the caption of a small tag readable

/// Dimensions of one tile, which are the same for all tags of a given family and size.
struct Tile {
  double cells_mm = 0;   ///< side length of all cells together
  double border_mm = 0;  ///< from the edge of the cells to the border square
  double white_mm = 0;   ///< white margin around the cells
  double width_mm = 0;
  double height_mm = 0;
  double caption_mm = 0;  ///< height of the caption
};

Tile tile_of(const Family& family, double tag_size_mm) {
  const double cell_mm = tag_size_mm / family.width_at_border;
  Tile tile;
  tile.cells_mm = cell_mm * family.total_width;
  tile.border_mm = cell_mm * (family.total_width - family.width_at_border) / 2;
  // Families with an outer border already include the white ring they need. The others end in data cells, so
  // half a cell of paper is added as a margin for cutting.
  tile.white_mm = family.reversed_border ? cell_mm / 2 : 0.0;
  tile.caption_mm = std::clamp(0.12 * tag_size_mm, 7.5, 16.0);
  tile.width_mm = std::max(tile.cells_mm + 2 * tile.white_mm, kNarrowestTileMm);
  tile.height_mm = tile.cells_mm + 2 * tile.white_mm + tile.caption_mm;
  return tile;
}

struct Grid {
  Paper paper;  ///< in the orientation used
  int columns = 0;
  int rows = 0;

  [[nodiscard]] int capacity() const { return columns * rows; }
};

int how_often(double length_mm, double room_mm) {
  return std::max(0, static_cast<int>(std::floor((room_mm + kToleranceMm) / length_mm)));
}

/// The largest grid of tiles on a sheet in the given orientation.
Grid grid_on(const Paper& paper, const Tile& tile, double margin_mm) {
  return {paper, how_often(tile.width_mm, paper.width_mm - 2 * margin_mm),
          how_often(tile.height_mm, paper.height_mm - 2 * margin_mm - kFooterHeightMm)};
}

/// The grid on the paper, rotated if that is allowed and helps to fit `wanted` tags (0 means as many as
/// possible).
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

tl::unexpected<Error> tags_do_not_fit(const Family& family, const SheetOptions& options) {
  const double size_mm = options.tag_size_m * 1e3;
  const std::string what =
      options.per_page > 1 ? fmt::format("{} {} tags of {} do not fit on one page of {}", options.per_page,
                                         family.name, millimetres(size_mm), options.paper.name)
                           : fmt::format("a {} tag of {} does not fit on {}", family.name,
                                         millimetres(size_mm), options.paper.name);
  const auto largest_m = largest_tag_size_m(family.id, options);
  std::string hint = largest_m ? fmt::format("The largest size that fits is {:g} m.", *largest_m)
                               : "No tag fits on this paper.";
  const auto& papers = known_papers();
  const auto enough = std::find_if(papers.begin(), papers.end(),
                                   [&](const Paper& paper) { return fits(family, size_mm, paper, options); });
  if (enough != papers.end()) {
    hint += fmt::format(" The smallest paper size that fits is {}.", enough->name);
  }
  return fail(ErrorCode::InvalidArgument, what, {.key = options.per_page > 1 ? "per_page" : "tag_size_m"},
              hint);
}

Status check_numbers(const Family& family, const std::vector<int>& numbers) {
  if (numbers.empty())
    return fail(ErrorCode::InvalidArgument, "no tags to draw", {.key = "ids"},
                "Pass some numbers, as in 0-3,7.");
  std::set<int> seen;
  for (const int number : numbers) {
    if (number < 0 || static_cast<std::size_t>(number) >= family.codes.size()) {
      return fail(ErrorCode::InvalidArgument, fmt::format("no tag number {} in {}", number, family.name),
                  {.key = "ids"},
                  fmt::format("{} has the numbers 0 to {}.", family.name, family.codes.size() - 1));
    }
    if (!seen.insert(number).second) {
      return fail(ErrorCode::InvalidArgument, fmt::format("duplicate tag number {}", number), {.key = "ids"},
                  "Use each number once: tags with equal numbers cannot be distinguished.");
    }
  }
  return {};
}

/// Reduces the grid to the columns and rows that the tags need.
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
  return fail(ErrorCode::InvalidArgument,
              fmt::format("{} m is not a valid size of a printed tag", tag_size_m), {.key = "tag_size_m"},
              millimetres_given
                  ? fmt::format("Sizes are in metres: {:g} mm is {:g}.", tag_size_m, tag_size_m / 1e3)
                  : fmt::format("Use {:g} to {:g} metres; 160 mm is 0.16.", kSmallestM, kLargestM));
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
  if (!fits(table, size_mm, options.paper, options)) return tags_do_not_fit(table, options);

  const Tile tile = tile_of(table, size_mm);
  Grid grid = best_grid(options.paper, tile, margin_mm, options.orientation, options.per_page);
  const int per_page = options.per_page > 0 ? options.per_page : grid.capacity();
  grid = shrunk_to(grid, std::min(per_page, static_cast<int>(numbers.size())));
  const auto step = static_cast<std::size_t>(per_page);
  if ((numbers.size() + step - 1) / step > kMaxPages) {
    return fail(ErrorCode::LimitExceeded,
                fmt::format("{} tags require more than {} pages", numbers.size(), kMaxPages), {.key = "ids"},
                "Print fewer tags at a time.");
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

namespace {

constexpr double kLongestRulerMm = 100.0;
constexpr double kRulerHeightMm = 4.5;
constexpr double kHairlineMm = 0.15;

void line(Point from, Point to, double width_mm, std::vector<Shape>& shapes) {
  shapes.emplace_back(Stroke{{from, to}, width_mm, kMarkColor, {}});
}

/// An arrowhead at `x_mm` that points away from `x_mm + length_mm`.
void tip(double x_mm, double y_mm, double length_mm, std::vector<Shape>& shapes) {
  const double half_mm = std::abs(length_mm) / 3.5;
  shapes.emplace_back(Fill{
      {{{x_mm, y_mm}, {x_mm + length_mm, y_mm - half_mm}, {x_mm + length_mm, y_mm + half_mm}}}, kMarkColor});
}

}  // namespace

std::string millimetres(double length_mm) {
  return short_number(std::round(length_mm * 100.0) / 100.0) + " mm";
}

Footer place_footer(const Paper& paper, double margin_mm) {
  Footer footer;
  footer.strip = {margin_mm, paper.height_mm - margin_mm - kFooterHeightMm, paper.width_mm - 2 * margin_mm,
                  kFooterHeightMm};
  constexpr double kStepMm = 10.0;
  // Half the width of the hairline at each end tick lies outside the marked length.
  const double room_mm = footer.strip.width_mm - kHairlineMm;
  const double length_mm = std::min(kLongestRulerMm, std::floor(room_mm / kStepMm) * kStepMm);
  footer.ruler = {paper.width_mm / 2 - length_mm / 2, footer.strip.y_mm + 1.5, length_mm, kRulerHeightMm};
  return footer;
}

void draw_footer(const Footer& footer, const std::string& remark, std::vector<Shape>& shapes) {
  const Box& ruler = footer.ruler;
  shapes.emplace_back(Group{"ruler"});
  // A bar of alternating black and white centimetres between its two ends.
  for (double at_mm = 0.0; at_mm < ruler.width_mm - kToleranceMm; at_mm += 20.0) {
    const double length_mm = std::min(10.0, ruler.width_mm - at_mm);
    shapes.emplace_back(filled({ruler.x_mm + at_mm, ruler.y_mm + 1.5, length_mm, 1.5}));
  }
  const double top_mm = ruler.y_mm + 1.5;
  const double bottom_mm = ruler.y_mm + 3.0;
  line({ruler.x_mm, top_mm}, {ruler.right_mm(), top_mm}, kHairlineMm, shapes);
  line({ruler.x_mm, bottom_mm}, {ruler.right_mm(), bottom_mm}, kHairlineMm, shapes);
  for (const double x_mm : {ruler.x_mm, ruler.right_mm()}) {
    line({x_mm, ruler.y_mm}, {x_mm, ruler.bottom_mm()}, kHairlineMm, shapes);
  }

  shapes.emplace_back(Group{"how-to-print"});
  const std::string how = fmt::format("Print at 100 %, no \u201cfit to page\u201d; this bar must measure {}.",
                                      millimetres(ruler.width_mm));
  const double middle_mm = footer.strip.middle_x_mm();
  const double room_mm = footer.strip.width_mm;
  shapes.emplace_back(
      Text{how, {middle_mm, ruler.bottom_mm() + 3.6}, 3.2, room_mm, Align::Middle, true, false, kMarkColor});
  shapes.emplace_back(Text{
      remark, {middle_mm, ruler.bottom_mm() + 7.6}, 2.8, room_mm, Align::Middle, false, false, kFaintColor});
}

void draw_dimension(double from_mm, double to_mm, const Box& strip, const std::string& words,
                    std::vector<Shape>& shapes) {
  const double y_mm = strip.middle_y_mm();
  const double length_mm = to_mm - from_mm;
  const double tip_mm = std::min({2.5, strip.height_mm * 0.6, length_mm / 6});
  const double height_mm = strip.height_mm * 0.8;
  const double wanted_mm = text_length_mm(words, height_mm, false);
  const double inside_mm = length_mm - 3 * tip_mm;
  const double beside_mm = strip.right_mm() - to_mm - 1.0;
  const bool beside = wanted_mm > inside_mm && beside_mm >= wanted_mm;
  const double words_mm = beside ? 0.0 : std::min(wanted_mm, inside_mm);
  const double gap_mm = beside ? 0.0 : words_mm + tip_mm / 2;
  const double middle_mm = (from_mm + to_mm) / 2;
  for (const double x_mm : {from_mm, to_mm})
    line({x_mm, strip.y_mm}, {x_mm, strip.bottom_mm()}, kHairlineMm, shapes);
  line({from_mm + tip_mm / 2, y_mm}, {middle_mm - gap_mm / 2, y_mm}, kHairlineMm, shapes);
  line({middle_mm + gap_mm / 2, y_mm}, {to_mm - tip_mm / 2, y_mm}, kHairlineMm, shapes);
  tip(from_mm, y_mm, tip_mm, shapes);
  tip(to_mm, y_mm, -tip_mm, shapes);
  const Point baseline{beside ? to_mm + 1.0 : middle_mm, y_mm + height_mm * 0.36};
  shapes.emplace_back(Text{words, baseline, height_mm, beside ? beside_mm : words_mm,
                           beside ? Align::Left : Align::Middle, false, false, kMarkColor});
}

void draw_up_mark(const Box& box, std::vector<Shape>& shapes) {
  shapes.emplace_back(
      Fill{{{{box.middle_x_mm(), box.y_mm}, {box.right_mm(), box.bottom_mm()}, {box.x_mm, box.bottom_mm()}}},
           kMarkColor});
}

namespace {

/// The name is in the middle of its row or, if it is long, in the middle of the space next to the up mark.
void draw_name(const std::string& name, const Box& row, double taken_mm, double baseline_mm,
               std::vector<Shape>& shapes) {
  const double height_mm = row.height_mm * 0.86;
  const bool centred = text_length_mm(name, height_mm, true) <= row.width_mm - 2 * taken_mm;
  const double middle_mm = centred ? row.middle_x_mm() : row.middle_x_mm() + taken_mm / 2;
  const double room_mm = row.width_mm - taken_mm * (centred ? 2 : 1) - 0.5;
  shapes.emplace_back(
      Text{name, {middle_mm, baseline_mm}, height_mm, room_mm, Align::Middle, true, false, kMarkColor});
}

void draw_sheet_caption(const PlacedTag& placed, double tag_size_mm, std::vector<Shape>& shapes) {
  const Box& box = placed.caption;
  const double row_mm = box.height_mm * 0.4;
  const Box arrow{box.x_mm, box.y_mm + box.height_mm * 0.06, box.width_mm, row_mm};
  const bool narrow = box.width_mm < 30.0;
  draw_dimension(placed.square.x_mm, placed.square.right_mm(), arrow,
                 (narrow ? "" : "size ") + millimetres(tag_size_mm), shapes);

  const Box& mark = placed.up_mark;
  draw_up_mark(mark, shapes);
  const double up_mm = narrow ? 0.0 : row_mm * 1.3;  // space for the word "up"
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

/// Draws the sides of the tiles, each shared side only once.
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
      draw_sheet_caption(placed, layout.tag_size_mm, page.shapes);
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
