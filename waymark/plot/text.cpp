#include "waymark/plot/text.hpp"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <fmt/format.h>

#include "waymark/plot/render.hpp"

namespace waymark::plot {
namespace {

struct Release {
  void operator()(cairo_t* canvas) const { cairo_destroy(canvas); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_font_options_t* options) const { cairo_font_options_destroy(options); }
  void operator()(cairo_path_t* path) const { cairo_path_destroy(path); }
};
template <class T>
using Owned = std::unique_ptr<T, Release>;

/// Outlines are unhinted, because hinting would make lengths depend on the resolution.
void select_font(cairo_t* canvas, double height_mm, bool bold) {
  cairo_select_font_face(canvas, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(canvas, height_mm);
  const Owned<cairo_font_options_t> options(cairo_font_options_create());
  cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(canvas, options.get());
}

double advance_mm(cairo_t* canvas, const std::string& words) {
  cairo_text_extents_t extents;
  cairo_text_extents(canvas, words.c_str(), &extents);
  return extents.x_advance;
}

/// Sets the origin, direction and font so that the text can be drawn at the current point.
void place(cairo_t* canvas, const Text& text) {
  select_font(canvas, text.height_mm, text.bold);
  double length_mm = advance_mm(canvas, text.words);
  if (length_mm > text.room_mm) {
    select_font(canvas, text.height_mm * text.room_mm / length_mm, text.bold);
    length_mm = text.room_mm;
  }
  const double back = text.align == Align::Left ? 0.0 : text.align == Align::Middle ? 0.5 : 1.0;
  cairo_translate(canvas, text.baseline.x_mm, text.baseline.y_mm);
  if (text.upwards) cairo_rotate(canvas, -std::numbers::pi / 2);
  cairo_move_to(canvas, -back * length_mm, 0.0);
}

/// A canvas used only for measuring, fine enough that cairo's fixed-point precision does not matter.
Owned<cairo_t> ruler_canvas() {
  // The surface is unbounded, because cairo omits letters far outside a surface, even from a path.
  const Owned<cairo_surface_t> surface(cairo_recording_surface_create(CAIRO_CONTENT_ALPHA, nullptr));
  Owned<cairo_t> canvas(cairo_create(surface.get()));
  constexpr double kUnitsPerMillimetre = 100.0;
  cairo_scale(canvas.get(), kUnitsPerMillimetre, kUnitsPerMillimetre);
  return canvas;
}

}  // namespace

void draw_text(cairo_t* canvas, const Text& text) {
  cairo_save(canvas);
  place(canvas, text);
  cairo_set_source_rgb(canvas, text.color.red, text.color.green, text.color.blue);
  cairo_show_text(canvas, text.words.c_str());
  cairo_new_path(canvas);
  cairo_restore(canvas);
}

std::string text_outline(const Text& text) {
  const Owned<cairo_t> canvas = ruler_canvas();
  cairo_save(canvas.get());
  place(canvas.get(), text);
  cairo_text_path(canvas.get(), text.words.c_str());
  cairo_restore(canvas.get());
  const Owned<cairo_path_t> path(cairo_copy_path(canvas.get()));
  std::string out;
  for (int i = 0; i < path->num_data; i += path->data[i].header.length) {
    const cairo_path_data_t* data = &path->data[i];
    if (data->header.type == CAIRO_PATH_CLOSE_PATH) {
      out += 'Z';
      continue;
    }
    // A move that is not followed by a line is merely the position of the next letter.
    if (data->header.type == CAIRO_PATH_MOVE_TO &&
        (i + data->header.length >= path->num_data ||
         data[data->header.length].header.type == CAIRO_PATH_MOVE_TO)) {
      continue;
    }
    out += data->header.type == CAIRO_PATH_MOVE_TO   ? 'M'
           : data->header.type == CAIRO_PATH_LINE_TO ? 'L'
                                                     : 'C';
    for (int k = 1; k < data->header.length; ++k) {
      out += fmt::format("{}{} {}", k > 1 ? " " : "", short_number(data[k].point.x),
                         short_number(data[k].point.y));
    }
  }
  return out;
}

std::string short_number(double value) {
  std::string digits = fmt::format("{:.4f}", value);
  digits.erase(digits.find_last_not_of('0') + 1);
  if (digits.back() == '.') digits.pop_back();
  return digits == "-0" ? "0" : digits;
}

double text_length_mm(const std::string& words, double height_mm, bool bold) {
  const Owned<cairo_t> canvas = ruler_canvas();
  select_font(canvas.get(), height_mm, bold);
  return words.empty() ? 0.0 : advance_mm(canvas.get(), words);
}

std::string escaped(std::string_view words) {
  std::string out;
  for (const char c : words) {
    switch (c) {
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '&':
        out += "&amp;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return out;
}

}  // namespace waymark::plot
