#include "waymark/plot/render.hpp"

#include <cairo-pdf.h>
#include <cairo.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "waymark/plot/file_marks.hpp"
#include "waymark/plot/text.hpp"

namespace waymark::plot {
namespace {

constexpr double kPointsPerMillimetre = 72.0 / 25.4;
constexpr double kMillimetresPerInch = 25.4;
constexpr double kLargestSideMm = 5000.0;
constexpr double kMostPixels = 200e6;
constexpr double kMostPixelsASide = 32767.0;  // cairo's own limit

struct Release {
  void operator()(cairo_t* canvas) const { cairo_destroy(canvas); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using Canvas = std::unique_ptr<cairo_t, Release>;
using Surface = std::unique_ptr<cairo_surface_t, Release>;

cairo_status_t append(void* sink, const unsigned char* data, unsigned int count) {
  auto& bytes = *static_cast<Bytes*>(sink);
  bytes.insert(bytes.end(), data, data + count);
  return CAIRO_STATUS_SUCCESS;
}

void use_color(cairo_t* canvas, const Color& color) {
  cairo_set_source_rgb(canvas, color.red, color.green, color.blue);
}

void trace(cairo_t* canvas, const std::vector<Point>& points) {
  for (const Point& point : points) cairo_line_to(canvas, point.x_mm, point.y_mm);
}

/// All loops are one path: no viewer can show a seam inside it.
void draw(cairo_t* canvas, const Fill& fill) {
  use_color(canvas, fill.color);
  cairo_set_fill_rule(canvas, CAIRO_FILL_RULE_EVEN_ODD);
  for (const auto& loop : fill.loops) {
    cairo_new_sub_path(canvas);
    trace(canvas, loop);
    cairo_close_path(canvas);
  }
  cairo_fill(canvas);
}

void draw(cairo_t* canvas, const Stroke& stroke) {
  use_color(canvas, stroke.color);
  cairo_set_line_width(canvas, stroke.width_mm);
  cairo_set_dash(canvas, stroke.dash_mm.data(), static_cast<int>(stroke.dash_mm.size()), 0.0);
  cairo_new_path(canvas);
  trace(canvas, stroke.points);
  cairo_stroke(canvas);
}

void draw(cairo_t* canvas, const Text& text) { draw_text(canvas, text); }
void draw(cairo_t*, const Group&) {}

void draw_page(cairo_t* canvas, const Drawing& page, double units_per_mm) {
  cairo_save(canvas);
  cairo_scale(canvas, units_per_mm, units_per_mm);
  cairo_set_line_join(canvas, CAIRO_LINE_JOIN_MITER);
  for (const Shape& shape : page.shapes) {
    std::visit([&](const auto& known) { draw(canvas, known); }, shape);
  }
  cairo_restore(canvas);
}

Status check_size(const Drawing& page) {
  const auto sane = [](double side_mm) { return side_mm > 0.0 && side_mm <= kLargestSideMm; };
  if (sane(page.width_mm) && sane(page.height_mm)) return {};
  return fail(ErrorCode::InvalidArgument, fmt::format("a page of {} x {} mm", page.width_mm, page.height_mm),
              {}, fmt::format("Each side must be more than 0 and at most {} mm.", kLargestSideMm));
}

tl::unexpected<Error> cairo_failed(cairo_status_t status) {
  return fail(status == CAIRO_STATUS_NO_MEMORY ? ErrorCode::LimitExceeded : ErrorCode::InvalidArgument,
              fmt::format("drawing failed: {}", cairo_status_to_string(status)));
}

/// Enough whole pixels for the length; rounding errors do not make it one more.
double pixels_of(double length_mm, double dpi) {
  return std::ceil(length_mm / kMillimetresPerInch * dpi - 1e-6);
}

}  // namespace

Result<FileFormat> format_of(std::string_view path) {
  std::string suffix(path.substr(std::min(path.size(), path.find_last_of("./\\"))));
  for (char& c : suffix) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (suffix == ".pdf") return FileFormat::Pdf;
  if (suffix == ".svg") return FileFormat::Svg;
  if (suffix == ".png") return FileFormat::Png;
  return fail(ErrorCode::InvalidArgument,
              suffix.starts_with('.') ? fmt::format("cannot write files of kind '{}'", suffix.substr(0, 20))
                                      : std::string("the file name does not say its kind"),
              {.source = std::string(path)}, "Let it end in .pdf, .svg or .png.");
}

Result<Bytes> render_pdf(std::span<const Drawing> pages) {
  if (pages.empty()) return fail(ErrorCode::InvalidArgument, "no pages to draw");
  for (const Drawing& page : pages) {
    if (const Status sane = check_size(page); !sane) return tl::unexpected<Error>(sane.error());
  }
  Bytes bytes;
  const Surface surface(cairo_pdf_surface_create_for_stream(append, &bytes, 1.0, 1.0));
  cairo_pdf_surface_restrict_to_version(surface.get(), CAIRO_PDF_VERSION_1_4);
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, pages.front().title.c_str());
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATOR, "Waymark");
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE,
                                 nullptr);  // same input, same bytes
  const Canvas canvas(cairo_create(surface.get()));
  for (const Drawing& page : pages) {
    cairo_pdf_surface_set_size(surface.get(), page.width_mm * kPointsPerMillimetre,
                               page.height_mm * kPointsPerMillimetre);
    draw_page(canvas.get(), page, kPointsPerMillimetre);
    cairo_show_page(canvas.get());
  }
  const cairo_status_t drawn = cairo_status(canvas.get());
  cairo_surface_finish(surface.get());
  if (drawn != CAIRO_STATUS_SUCCESS) return cairo_failed(drawn);
  ask_to_print_unscaled(bytes);
  return bytes;
}

Result<Bytes> render_png(const Drawing& page, double dpi) {
  if (const Status sane = check_size(page); !sane) return tl::unexpected<Error>(sane.error());
  if (!(dpi >= 10.0 && dpi <= 2400.0)) {
    return fail(ErrorCode::InvalidArgument, fmt::format("{} pixels an inch", dpi), {.key = "dpi"},
                "Give 10 to 2400; printers want 300 or 600.");
  }
  const double width_px = pixels_of(page.width_mm, dpi);
  const double height_px = pixels_of(page.height_mm, dpi);
  if (width_px * height_px > kMostPixels || std::max(width_px, height_px) > kMostPixelsASide) {
    return fail(ErrorCode::LimitExceeded,
                fmt::format("a picture of {:.0f} x {:.0f} pixels", width_px, height_px), {.key = "dpi"},
                "Lower the dpi, or write .pdf or .svg, which have no pixels.");
  }
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(width_px),
                                                   static_cast<int>(height_px)));
  const Canvas canvas(cairo_create(surface.get()));
  use_color(canvas.get(), kWhite);
  cairo_paint(canvas.get());
  draw_page(canvas.get(), page, dpi / kMillimetresPerInch);
  if (cairo_status(canvas.get()) != CAIRO_STATUS_SUCCESS) return cairo_failed(cairo_status(canvas.get()));
  Bytes bytes;
  const cairo_status_t written = cairo_surface_write_to_png_stream(surface.get(), append, &bytes);
  if (written != CAIRO_STATUS_SUCCESS) return cairo_failed(written);
  record_resolution(bytes, dpi);
  return bytes;
}

}  // namespace waymark::plot
