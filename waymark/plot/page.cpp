#include "waymark/plot/page.hpp"

#include <string_view>

#include <fmt/format.h>

#include "waymark/plot/render.hpp"
#include "waymark/plot/text.hpp"

namespace waymark::plot {
namespace {

constexpr std::string_view kStyle = R"(
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 0 auto; padding: 1rem; }
h1 { margin-bottom: 0; } h2 { border-bottom: 1px solid gray; margin-top: 2.5rem; }
nav a { margin-right: 1rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; margin: 1rem 0; }
caption { text-align: left; font-weight: bold; padding: .25rem 0; }
th, td { padding: .15rem .75rem .15rem 0; text-align: right; font-variant-numeric: tabular-nums; }
th:first-child, td:first-child { text-align: left; }
tr + tr { border-top: 1px solid rgba(128, 128, 128, .35); }
figure { margin: 1.5rem 0; } figcaption { font-size: .9rem; }
figure svg { width: min(100%, 45rem); height: auto; background: white; }
@media print { h2 { break-after: avoid; } figure, table { break-inside: avoid; } }
)";

std::string row(const std::vector<std::string>& cells, std::string_view cell) {
  std::string text = "<tr>";
  for (const std::string& words : cells) text += fmt::format("<{0}>{1}</{0}>", cell, escaped(words));
  return text + "</tr>\n";
}

std::string table(const PageTable& table) {
  std::string text = "<div class=\"wide\"><table>\n";
  if (!table.caption.empty()) text += fmt::format("<caption>{}</caption>\n", escaped(table.caption));
  if (!table.head.empty()) text += "<thead>" + row(table.head, "th") + "</thead>";
  text += "<tbody>\n";
  for (const auto& cells : table.rows) text += row(cells, "td");
  return text + "</tbody></table></div>\n";
}

Result<std::string> figure(const PageFigure& figure) {
  const auto named = [&](Error error) {
    error.message = fmt::format("figure '{}': {}", figure.name, error.message);
    return tl::unexpected(std::move(error));
  };
  const Result<Drawing> drawing = draw_figure(figure.figure);
  if (!drawing) return named(drawing.error());
  const Result<Bytes> svg = render_svg(*drawing);
  if (!svg) return named(svg.error());
  std::string_view drawn(reinterpret_cast<const char*>(svg->data()), svg->size());
  drawn.remove_prefix(drawn.find("<svg") + 4);  // the page has a prologue of its own
  return fmt::format("<figure>\n<svg role=\"img\"{}\n<figcaption>{}</figcaption>\n</figure>\n", drawn,
                     escaped(figure.caption));
}

Result<std::string> section(const PageSection& section, std::size_t number) {
  std::string text = fmt::format("<section id=\"s{}\">\n<h2>{}</h2>\n", number, escaped(section.title));
  for (const std::string& words : section.words) text += fmt::format("<p>{}</p>\n", escaped(words));
  for (const PageTable& each : section.tables) text += table(each);
  for (const PageFigure& each : section.figures) {
    const Result<std::string> drawn = figure(each);
    if (!drawn) return tl::unexpected(drawn.error());
    text += *drawn;
  }
  return text + "</section>\n";
}

}  // namespace

Result<std::string> to_html(const Page& page) {
  std::string text = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, "
      "initial-scale=1\">\n{3}\n<title>{0}</title>\n<style>{1}</style>\n</head>\n"
      "<body>\n<h1>{0}</h1>\n<p>{2}</p>\n<nav>",
      escaped(page.title), kStyle, escaped(page.subtitle), kPageMark);
  for (std::size_t i = 0; i < page.sections.size(); ++i)
    text += fmt::format("<a href=\"#s{}\">{}</a>\n", i, escaped(page.sections[i].title));
  text += "</nav>\n<main>\n";
  for (std::size_t i = 0; i < page.sections.size(); ++i) {
    const Result<std::string> part = section(page.sections[i], i);
    if (!part) return tl::unexpected(part.error());
    text += *part;
  }
  return text + "</main>\n</body>\n</html>\n";
}

}  // namespace waymark::plot
