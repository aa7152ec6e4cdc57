#include <cmath>
#include <string>

#include <fmt/format.h>

#include "waymark/plot/render.hpp"
#include "waymark/plot/text.hpp"

// Written by hand instead of by cairo: a group keeps its name, a length keeps its millimetres, and the bytes
// do not depend on what was drawn before (cairo numbers its surfaces).
namespace waymark::plot {
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
                fmt::format("a page of {} x {} mm", page.width_mm, page.height_mm), {},
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
