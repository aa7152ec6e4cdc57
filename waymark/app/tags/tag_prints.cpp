#include "waymark/app/tags/tag_prints.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/output_files.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/media/board_finder.hpp"

namespace waymark {

std::string page_path(const std::string& path, std::size_t page, std::size_t pages) {
  if (pages == 1) return path;
  std::filesystem::path name(path);
  const std::size_t digits = std::to_string(pages).size();
  const std::string numbered =
      fmt::format("{}-{:0{}}{}", name.stem().string(), page, digits, name.extension().string());
  return name.replace_filename(numbered).string();
}

WrittenPages write_pages(const std::vector<plot::Drawing>& pages, const PageFiles& to,
                         const JobControl& control) {
  WrittenPages written;
  const plot::FileFormat format = to.format;
  const std::size_t files = format == plot::FileFormat::Pdf ? 1 : pages.size();
  for (std::size_t i = 0; i < files && written.status; ++i)
    written.status = check_new_file(page_path(to.path, i + 1, files), to.replace);
  const std::string target =
      std::filesystem::path(page_path(to.path, 1, files)).replace_extension(".yaml").string();
  if (written.status && !to.target.empty()) written.status = check_new_file(target, to.replace);
  if (!written.status) return written;
  for (std::size_t i = 0; i < files; ++i) {
    written.status = control.go_on();
    if (!written.status) return written;
    const std::string file = page_path(to.path, i + 1, files);
    control.progress({.text = file, .done = i, .all = files});
    const auto bytes = format == plot::FileFormat::Pdf   ? plot::render_pdf(pages)
                       : format == plot::FileFormat::Svg ? plot::render_svg(pages[i])
                                                         : plot::render_png(pages[i], to.dpi);
    written.status = bytes ? write_bytes(file, *bytes) : Status(tl::unexpected(bytes.error()));
    if (!written.status) return written;
    written.files.push_back(file);
  }
  if (to.target.empty()) return written;
  const std::vector<std::uint8_t> bytes(to.target.begin(), to.target.end());
  written.status = write_bytes(target, bytes);
  if (written.status) written.files.push_back(target);
  return written;
}

Result<FamilyId> requested_family(const PageRequest& request) {
  auto id = parse_family(request.family);
  if (!id) id.error().place.key = "family";
  return id;
}

Result<std::vector<plot::Cells>> printed_markers(const CalibrationBoard& board) {
  std::vector<plot::Cells> markers;
  if (board.kind != BoardKind::Charuco) return markers;
  const auto finder = BoardFinder::load();
  if (!finder) return tl::unexpected(finder.error());
  for (const BoardMarker& marker : board_markers(board)) {
    const auto inner = finder->marker(board.dictionary, marker.id);
    if (!inner) return tl::unexpected(inner.error());
    plot::Cells cells{.width = inner->width + 2, .ink = {}};
    cells.ink.assign(static_cast<std::size_t>(cells.width) * static_cast<std::size_t>(cells.width), true);
    auto black = inner->black.begin();
    for (int y = 0; y < inner->width; ++y)
      for (int x = 0; x < inner->width; ++x, ++black) cells.ink[cells.index(x + 1, y + 1)] = *black;
    markers.push_back(std::move(cells));
  }
  return markers;
}

Result<plot::SquareBoardLayout> plan_square_board(plot::SquareBoardOptions options) {
  if (const Status usable = check_board(options.board); !usable) return tl::unexpected(usable.error());
  auto markers = printed_markers(options.board);
  if (!markers) return tl::unexpected(markers.error());
  options.markers = *std::move(markers);
  return plot::layout_square_board(options);
}

Status check_board_style(const std::string& style) {
  const std::vector<std::string> styles = {"aprilgrid", "separate", "chessboard", "charuco"};
  if (std::ranges::find(styles, style) != styles.end()) return {};
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown board style '{}'", style.substr(0, 60)),
              {.key = "style"}, suggestion(style, styles));
}

Status check_effects(const BoardRequest& board, const GivenFields& given) {
  if (const Status valid = check_board_style(board.style); !valid) return valid;
  const bool squares = board.of_squares();
  const char* hint = squares ? "Omit this option, or use `style=separate` or aprilgrid."
                             : "Omit this option, or use `style=chessboard` or charuco.";
  const std::string why = fmt::format("has no effect on the style {}", board.style);
  FieldRefusals refused(given);
  refused.fields(!squares, {"square_size_m", "marker_size_m", "dictionary", "legacy_pattern", "tiled"}, why,
                 hint);
  refused.fields(squares, {"tag_size_m", "spacing", "family", "kalibr_yaml"}, why, hint);
  refused.fields(board.style == "chessboard", {"marker_size_m", "dictionary", "legacy_pattern", "first_id"},
                 why, "Omit this option.");
  return refused.status();
}

Result<PlannedBoard> plan_board(const plot::BoardOptions& options, bool kalibr) {
  auto layout = plot::layout_board(options);
  if (!layout) return tl::unexpected(layout.error());
  if (!kalibr) return PlannedBoard{std::move(*layout), {}};
  auto target = plot::kalibr_target(options);
  if (target) return PlannedBoard{std::move(*layout), std::move(*target)};
  target.error().place.key = "kalibr_yaml";
  return tl::unexpected(std::move(target.error()));
}

std::string to_text(const plot::BoardLayout& layout, const std::vector<std::string>& files) {
  const plot::BoardOptions& options = layout.options;
  std::string text = fmt::format("{}: {} board of {} x {} tags, {} of {:g} m, 1 page {}\n", files.front(),
                                 to_string(options.style), options.columns, options.rows,
                                 to_string(options.family), options.tag_size_m, layout.paper.name);
  if (files.size() > 1) text += fmt::format("{}: the target file for Kalibr\n", files.back());
  return text;
}

std::string to_text(const plot::SheetLayout& layout, const std::vector<std::string>& files) {
  const std::size_t pages = layout.pages.size();
  const std::size_t tags = layout.pages.front().size();
  return fmt::format("{}: {} {}, {} per page, {} of {:g} m\n",
                     files.size() == 1 ? files.front() : files.front() + " …", counted(pages, "page"),
                     layout.paper.name, counted(tags, "tag"), to_string(layout.family),
                     layout.tag_size_mm / 1e3);
}

std::string to_text(const plot::SquareBoardLayout& layout, const std::vector<std::string>& files) {
  const CalibrationBoard& board = layout.options.board;
  const std::size_t pages = layout.pages.size();
  return fmt::format("{}: {} of {} x {} squares of {:g} m, {} {}\n",
                     files.size() == 1 ? files.front() : files.front() + " …", to_string(board.kind),
                     board.columns, board.rows, board.size_m, counted(pages, "page"), layout.paper.name);
}

// Conversion to report fields.
namespace {

void add_print(ReportFields& all, const plot::Paper& paper, const plot::Footer& footer,
               const std::vector<std::string>& files) {
  const std::array size_m = {paper.width_mm / 1e3, paper.height_mm / 1e3};
  all.insert(all.end(), {{"paper", "Name of the paper", paper.name},
                         {"paper_size_m", "[width, height] of the printed page", size_m},
                         {"ruler_m", "Length of the printed ruler", footer.ruler.width_mm / 1e3},
                         {"files", "Written files; the target file of a board is the last", files}});
}

constexpr const char* kStyle = "aprilgrid, separate, chessboard or charuco";
constexpr const char* kColumns = "Number of tags, or squares, in a row";
constexpr const char* kRows = "Number of tags, or squares, in a column";
constexpr const char* kFirstId = "Id of the lower left tag, or of the first marker of a ChArUco board";

}  // namespace

ReportFields fields(const Printed<plot::BoardLayout>& board) {
  const plot::BoardLayout& layout = board.layout;
  const plot::BoardOptions& options = layout.options;
  ReportFields all = {
      {"pages", "Number of pages", 1},
      {"tags", "aprilgrid, separate: number of tags", layout.tags.size()},
      {"tags_per_page", "aprilgrid, separate: number of tags on a full page", layout.tags.size()},
      {"style", kStyle, to_string(options.style)},
      {"family", "aprilgrid, separate: family of the tags", to_string(options.family)},
      {"cols", kColumns, options.columns},
      {"rows", kRows, options.rows},
      {"first_id", kFirstId, options.first_id},
      {"tag_size_m", "aprilgrid, separate: side of the square at the edge between black and white border",
       options.tag_size_m},
      {"spacing", "aprilgrid, separate: gap between two tags, as a share of their size", options.spacing}};
  add_print(all, layout.paper, layout.footer, board.files);
  return all;
}

ReportFields fields(const Printed<plot::SheetLayout>& sheet) {
  const plot::SheetLayout& layout = sheet.layout;
  std::size_t tags = 0;
  for (const auto& page : layout.pages) tags += page.size();
  ReportFields all = {{"pages", "Number of pages", layout.pages.size()},
                      {"tags", "Number of tags", tags},
                      {"tags_per_page", "Number of tags on a full page", layout.tags_per_page},
                      {"family", "Family of the tags", to_string(layout.family)},
                      {"tag_size_m", "Side of the square at the edge between black and white border",
                       layout.tag_size_mm / 1e3}};
  add_print(all, layout.paper, layout.footer, sheet.files);
  return all;
}

ReportFields fields(const Printed<plot::SquareBoardLayout>& board) {
  const CalibrationBoard& squares = board.layout.options.board;
  const auto of_charuco = [&](const auto& value) {
    return if_any(squares.kind == BoardKind::Charuco ? std::optional(value) : std::nullopt);
  };
  ReportFields all = {
      {"pages", "Number of pages", board.layout.pages.size()},
      {"style", kStyle, to_string(squares.kind)},
      {"cols", kColumns, squares.columns},
      {"rows", kRows, squares.rows},
      {"square_size_m", "charuco, chessboard: side of a square", squares.size_m},
      {"marker_size_m", "charuco: side of the black square of a marker", of_charuco(squares.marker_m)},
      {"dictionary", "charuco: dictionary of the markers", of_charuco(squares.dictionary)},
      {"legacy_pattern", "charuco: pattern of OpenCV before 4.6", of_charuco(squares.legacy_pattern)},
      {"first_id", kFirstId, of_charuco(squares.first_id)}};
  add_print(all, board.layout.paper, board.layout.footer, board.files);
  return all;
}

}  // namespace waymark
