#include "waymark/plot/render.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <cairo-pdf.h>
#include <cairo.h>
#include <fmt/format.h>

#include "waymark/plot/text.hpp"

namespace waymark::plot {
namespace {

std::optional<int> number_after(std::string_view text, std::string_view word) {
  const std::size_t at = text.find(word);
  if (at == std::string_view::npos) return std::nullopt;
  const std::size_t first = text.find_first_of("0123456789", at + word.size());
  if (first == std::string_view::npos) return std::nullopt;
  int value = 0;
  const auto [end, failure] = std::from_chars(text.data() + first, text.data() + text.size(), value);
  return failure == std::errc() ? std::optional(value) : std::nullopt;
}

/// The text between "<<" and the last ">>" of an object.
std::optional<std::string> dictionary_of(std::string_view pdf, int object) {
  const std::size_t at = pdf.rfind(fmt::format("\n{} 0 obj", object));
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view body = pdf.substr(at, pdf.find("endobj", at) - at);
  const std::size_t open = body.find("<<");
  const std::size_t close = body.rfind(">>");
  if (open == std::string_view::npos || close == std::string_view::npos) return std::nullopt;
  return std::string(body.substr(open + 2, close - open - 2));
}

/// CRC-32 as defined in the PNG specification, annex D.
std::uint32_t crc32(const std::uint8_t* data, std::size_t count) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (std::size_t i = 0; i < count; ++i) {
    crc ^= data[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~crc;
}

void put_big_endian(std::uint8_t* out, std::uint32_t value) {
  for (unsigned i = 0; i < 4; ++i) out[i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}

/// Appends an update to a PDF that sets ViewerPreferences / PrintScaling to None (ISO 32000-1, 7.5.6 and
/// table 150), so that print dialogues default to 100 %. A PDF that does not have a single cross-reference
/// table, as written by cairo 1.4 and later, is left unchanged.
void ask_to_print_unscaled(std::vector<std::uint8_t>& pdf) {
  const std::string_view text(reinterpret_cast<const char*>(pdf.data()), pdf.size());
  const std::size_t trailer_at = text.rfind("trailer");
  if (trailer_at == std::string_view::npos) return;
  const std::string_view trailer = text.substr(trailer_at);
  const auto root = number_after(trailer, "/Root");
  const auto info = number_after(trailer, "/Info");
  const auto size = number_after(trailer, "/Size");
  const auto previous = number_after(trailer, "startxref");
  if (!root || !info || !size || !previous) return;
  const auto catalog = dictionary_of(text, *root);
  if (!catalog) return;

  const std::string object = fmt::format(
      "{} 0 obj\n<<{}   /ViewerPreferences << /PrintScaling /None >>\n>>\nendobj\n", *root, *catalog);
  const std::string update = fmt::format(
      "{}xref\n{} 1\n{:010} 00000 n \ntrailer\n<< /Size {} /Root {} 0 R /Info {} 0 R /Prev {} "
      ">>\nstartxref\n{}\n%%EOF\n",
      object, *root, pdf.size(), *size, *root, *info, *previous, pdf.size() + object.size());
  pdf.insert(pdf.end(), update.begin(), update.end());
}

/// Inserts the pHYs chunk (PNG specification, 11.3.5.3) after the header.
void record_resolution(std::vector<std::uint8_t>& png, double dpi) {
  constexpr std::size_t kEndOfHeader = 33;  // 8 bytes of signature, 4 + 4 + 13 + 4 bytes of IHDR
  constexpr double kMetresPerInch = 0.0254;
  if (png.size() < kEndOfHeader) return;
  std::array<std::uint8_t, 21> chunk = {0, 0, 0, 9, 'p', 'H', 'Y', 's'};
  const auto per_metre = static_cast<std::uint32_t>(std::lround(dpi / kMetresPerInch));
  put_big_endian(&chunk[8], per_metre);
  put_big_endian(&chunk[12], per_metre);
  chunk[16] = 1;  // the unit is the metre
  put_big_endian(&chunk[17], crc32(&chunk[4], 13));
  png.insert(png.begin() + kEndOfHeader, chunk.begin(), chunk.end());
}

constexpr double kPointsPerMillimetre = 72.0 / 25.4;
constexpr double kMillimetresPerInch = 25.4;
constexpr double kLargestSideMm = 5000.0;
constexpr double kMaxPixels = 200e6;
constexpr double kMaxPixelsASide = 32767.0;  // limit imposed by cairo

struct CairoRelease {
  void operator()(cairo_t* canvas) const { cairo_destroy(canvas); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using Canvas = std::unique_ptr<cairo_t, CairoRelease>;
using Surface = std::unique_ptr<cairo_surface_t, CairoRelease>;

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

/// All loops form one path, so viewers cannot show seams inside it.
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
  return fail(ErrorCode::InvalidArgument,
              fmt::format("invalid page size {} x {} mm", page.width_mm, page.height_mm), {},
              fmt::format("Each side must be more than 0 and at most {} mm.", kLargestSideMm));
}

tl::unexpected<Error> cairo_failed(cairo_status_t status) {
  return fail(status == CAIRO_STATUS_NO_MEMORY ? ErrorCode::LimitExceeded : ErrorCode::InvalidArgument,
              fmt::format("drawing failed: {}", cairo_status_to_string(status)));
}

/// The number of whole pixels that cover the length; a rounding error does not add a pixel.
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
              suffix.starts_with('.') ? fmt::format("unsupported file format '{}'", suffix.substr(0, 20))
                                      : std::string("the file name has no suffix"),
              {.key = std::string(path)}, "Use the suffix .pdf, .svg or .png.");
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
                                 nullptr);  // omits the date, so that the same input gives the same bytes
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
    return fail(ErrorCode::InvalidArgument, fmt::format("invalid resolution of {} pixels per inch", dpi),
                {.key = "dpi"}, "Use 10 to 2400; for printing, 300 or 600.");
  }
  const double width_px = pixels_of(page.width_mm, dpi);
  const double height_px = pixels_of(page.height_mm, dpi);
  if (width_px * height_px > kMaxPixels || std::max(width_px, height_px) > kMaxPixelsASide) {
    return fail(ErrorCode::LimitExceeded,
                fmt::format("image of {:.0f} x {:.0f} pixels is too large", width_px, height_px),
                {.key = "dpi"}, "Lower `dpi`, or write .pdf or .svg, which have no pixels.");
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

// Written without cairo, so that groups keep their names, lengths stay in millimetres, and the bytes do not
// depend on earlier drawings (cairo numbers its surfaces).

namespace {

std::string hex(const Color& color) {
  const auto byte = [](double share) { return std::lround(share * 255.0); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(color.red), byte(color.green), byte(color.blue));
}

std::string path_of(const std::vector<Point>& points) {
  std::string out;
  for (const Point& point : points) {
    out +=
        fmt::format("{}{} {}", out.empty() ? "M" : "L", short_number(point.x_mm), short_number(point.y_mm));
  }
  return out;
}

class Writer {
 public:
  void operator()(const Fill& fill) {
    std::string data;
    for (const auto& loop : fill.loops) data += path_of(loop) + "Z";
    out += fmt::format("<path fill=\"{}\" fill-rule=\"evenodd\" d=\"{}\"/>\n", hex(fill.color), data);
  }

  void operator()(const Stroke& stroke) {
    std::string dash;
    for (const double length_mm : stroke.dash_mm) dash += (dash.empty() ? "" : " ") + short_number(length_mm);
    if (!dash.empty()) dash = " stroke-dasharray=\"" + dash + "\"";
    out += fmt::format("<path fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{} d=\"{}\"/>\n",
                       hex(stroke.color), short_number(stroke.width_mm), dash, path_of(stroke.points));
  }

  void operator()(const Text& text) {
    out += fmt::format("<path fill=\"{}\" aria-label=\"{}\" d=\"{}\"/>\n", hex(text.color),
                       escaped(text.words), text_outline(text));
  }

  void operator()(const Group& group) {
    close_group();
    out += fmt::format("<g id=\"{}\">\n", escaped(group.name));
    in_group_ = true;
  }

  void close_group() {
    if (in_group_) out += "</g>\n";
    in_group_ = false;
  }

  std::string out;

 private:
  bool in_group_ = false;
};

}  // namespace

Result<Bytes> render_svg(const Drawing& page) {
  if (!(page.width_mm > 0.0 && page.height_mm > 0.0 && page.width_mm <= 5000.0 && page.height_mm <= 5000.0)) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("invalid page size {} x {} mm", page.width_mm, page.height_mm), {},
                "Each side must be more than 0 and at most 5000 mm.");
  }
  const std::string width = short_number(page.width_mm);
  const std::string height = short_number(page.height_mm);
  Writer writer;
  writer.out = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<svg xmlns=\"http://www.w3.org/2000/svg\" version=\"1.1\" width=\"{0}mm\" height=\"{1}mm\" "
      "viewBox=\"0 0 {0} {1}\">\n"
      "<title>{2}</title>\n<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
      width, height, escaped(page.title));
  for (const Shape& shape : page.shapes) std::visit(writer, shape);
  writer.close_group();
  writer.out += "</svg>\n";
  return Bytes(writer.out.begin(), writer.out.end());
}

}  // namespace waymark::plot
