#include "waymark/plot/annotate.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>

#include <cairo.h>
#include <fmt/format.h>

#include "waymark/samples/tag_detection.hpp"

namespace waymark::plot {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;
using ImageSurface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

constexpr Rgb kXAxis{235, 40, 40};
constexpr Rgb kYAxis{30, 190, 60};
constexpr Rgb kSide{250, 210, 40};
constexpr Rgb kBox{70, 140, 255};
constexpr Rgb kPaper{0, 0, 0};

void set_color(cairo_t* cr, Rgb color, double alpha = 1.0) {
  cairo_set_source_rgba(cr, color.r / 255.0, color.g / 255.0, color.b / 255.0, alpha);
}

void line(cairo_t* cr, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  cairo_move_to(cr, from.x(), from.y());
  cairo_line_to(cr, to.x(), to.y());
  cairo_stroke(cr);
}

void draw_sides(cairo_t* cr, const Corners& corners, double width) {
  cairo_set_line_width(cr, width);
  set_color(cr, kSide);
  line(cr, corners[1], corners[2]);
  line(cr, corners[2], corners[3]);
  set_color(cr, kYAxis);
  line(cr, corners[0], corners[3]);
  set_color(cr, kXAxis);
  line(cr, corners[0], corners[1]);
  cairo_arc(cr, corners[0].x(), corners[0].y(), 2 * width, 0, 2 * 3.141592653589793);
  cairo_fill(cr);
}

void draw_center(cairo_t* cr, const Eigen::Vector2d& center, double arm, double width) {
  cairo_set_line_width(cr, width);
  set_color(cr, kSide);
  line(cr, center - Eigen::Vector2d(arm, 0), center + Eigen::Vector2d(arm, 0));
  line(cr, center - Eigen::Vector2d(0, arm), center + Eigen::Vector2d(0, arm));
}

/// Draws the label above the box, or below it if there is no room above, and inside the image if possible.
void draw_label(cairo_t* cr, const std::string& words, const Eigen::Vector2d& low,
                const Eigen::Vector2d& high, double height, const ImageView& image) {
  cairo_set_font_size(cr, height);
  cairo_text_extents_t size;
  cairo_text_extents(cr, words.c_str(), &size);
  const double pad = 0.25 * height;
  const double width_needed = size.x_advance + 2 * pad;
  const double height_needed = height + 2 * pad;
  const double x = std::clamp(low.x(), 0.0, std::max(0.0, image.width - width_needed));
  const bool fits_above = low.y() - height_needed >= 0;
  const double y = std::clamp(fits_above ? low.y() - height_needed : high.y(), 0.0,
                              std::max(0.0, image.height - height_needed));
  set_color(cr, kPaper, 0.6);
  cairo_rectangle(cr, x, y, width_needed, height_needed);
  cairo_fill(cr);
  set_color(cr, kSide);
  cairo_move_to(cr, x + pad, y + pad + 0.8 * height);
  cairo_show_text(cr, words.c_str());
}

void draw_tag(cairo_t* cr, const TagDetection& detection, const ImageView& image) {
  Corners corners = detection.corners_px;
  // Cairo uses 24.8 fixed-point numbers, so coordinates far outside the image would wrap around.
  const Eigen::Vector2d reach(2.0 * image.width, 2.0 * image.height);
  for (auto& corner : corners) {
    if (!corner.allFinite()) return;
    corner = corner.cwiseMax(-reach).cwiseMin(reach);
  }
  Eigen::Vector2d low = corners[0];
  Eigen::Vector2d high = corners[0];
  for (const auto& corner : corners) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  const double side = mean_side_px(corners);
  const double width = std::clamp(side / 40, 1.5, 4.0);
  cairo_set_line_width(cr, 1);
  set_color(cr, kBox);
  cairo_rectangle(cr, low.x(), low.y(), high.x() - low.x(), high.y() - low.y());
  cairo_stroke(cr);
  draw_sides(cr, corners, width);
  draw_center(cr, center_px(corners), std::max(2.0, side / 12), width);
  const Eigen::Vector2d gap = Eigen::Vector2d::Constant(2 * width);
  draw_label(cr, to_string(detection.tag), low - gap, high + gap, std::clamp(side / 6, 10.0, 32.0), image);
}

void draw_tag_axes(cairo_t* cr, const FrameAxes& axes, const ImageView& image) {
  const Eigen::Vector2d reach(2.0 * image.width, 2.0 * image.height);
  const auto end = [&](const Eigen::Vector2d& px) -> Eigen::Vector2d {
    return px.cwiseMax(-reach).cwiseMin(reach);
  };
  if (!axes.origin_px.allFinite() || !axes.x_px.allFinite() || !axes.y_px.allFinite() ||
      !axes.z_px.allFinite())
    return;
  cairo_set_line_width(cr, 3);
  set_color(cr, kXAxis);
  line(cr, end(axes.origin_px), end(axes.x_px));
  set_color(cr, kYAxis);
  line(cr, end(axes.origin_px), end(axes.y_px));
  set_color(cr, kBox);
  line(cr, end(axes.origin_px), end(axes.z_px));
}

void copy_in(const ImageView& image, cairo_surface_t* surface) {
  std::uint8_t* pixels = cairo_image_surface_get_data(surface);
  const std::ptrdiff_t stride = cairo_image_surface_get_stride(surface);
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* from = image.row(y);
    std::uint8_t* to = pixels + y * stride;
    for (int x = 0; x < image.width; ++x) {
      const std::uint32_t value = from[x] * 0x010101U;
      std::memcpy(to + 4 * static_cast<std::ptrdiff_t>(x), &value, sizeof value);
    }
  }
  cairo_surface_mark_dirty(surface);
}

ColorImage copy_out(cairo_surface_t* surface, int width, int height) {
  cairo_surface_flush(surface);
  const std::uint8_t* pixels = cairo_image_surface_get_data(surface);
  const std::ptrdiff_t stride = cairo_image_surface_get_stride(surface);
  ColorImage color(width, height);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* from = pixels + y * stride;
    Rgb* to = color.row(y);
    for (int x = 0; x < width; ++x) {
      std::uint32_t value = 0;
      std::memcpy(&value, from + 4 * static_cast<std::ptrdiff_t>(x), sizeof value);
      to[x] = {static_cast<std::uint8_t>(value >> 16U), static_cast<std::uint8_t>(value >> 8U),
               static_cast<std::uint8_t>(value)};
    }
  }
  return color;
}

}  // namespace

Result<ColorImage> annotate(const ImageView& image, std::span<const TagDetection> detections,
                            std::span<const FrameAxes> axes) {
  if (image.empty()) return ColorImage();
  const ImageSurface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, image.width, image.height),
                             cairo_surface_destroy);
  if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS) {
    return fail(ErrorCode::LimitExceeded,
                fmt::format("cannot draw on {} x {} px: {}", image.width, image.height,
                            cairo_status_to_string(cairo_surface_status(surface.get()))),
                {}, "Reduce the image to at most 32767 px per side.");
  }
  copy_in(image, surface.get());
  {
    const Context context(cairo_create(surface.get()), cairo_destroy);
    cairo_select_font_face(context.get(), "@cairo:monospace", CAIRO_FONT_SLANT_NORMAL,
                           CAIRO_FONT_WEIGHT_BOLD);
    for (const TagDetection& detection : detections) draw_tag(context.get(), detection, image);
    for (const FrameAxes& frame : axes) draw_tag_axes(context.get(), frame, image);
  }
  return copy_out(surface.get(), image.width, image.height);
}

}  // namespace waymark::plot
