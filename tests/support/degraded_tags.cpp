#include "tests/support/degraded_tags.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <fmt/format.h>
#include <Eigen/Dense>

#include "tests/support/draw_tag.hpp"
#include "waymark/base/random.hpp"

namespace waymark::testing {
namespace {

constexpr int kWidth = 1280;
constexpr int kHeight = 720;
constexpr double kFocal = 1100;
constexpr double kPi = std::numbers::pi;

/// Grey levels before noise and rounding.
struct Canvas {
  std::vector<float> level = std::vector<float>(std::size_t{kWidth} * kHeight);
  [[nodiscard]] float& at(int x, int y) {
    return level[static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x)];
  }
};

/// Degradations of the entire image.
struct Look {
  double blur_px = 0.6;
  double noise = 2;
  double motion_px = 0;
  double motion_rad = 0;
};

/// Print and illumination of one tag; lengths in cells of the tag, from the corner TL of its border square.
struct Print {
  double black = 40;
  double white = 200;
  double margin = 1;
  bool inverted = false;
  Eigen::Vector2d slope{0, 0};  ///< relative change of illumination over the tag
  double shadow = 1;            ///< illumination beyond the line
  Eigen::Vector3d shadow_line{0, 0, -1};
  double bar_level = -1;  ///< grey level of an occluder; negative: no occluder
  double bar_begin = 0, bar_end = 0;
  int bar_side = 0;
  double glare = 0;  ///< grey levels added at its middle
  Eigen::Vector2d glare_at{0, 0};
  double glare_radius = 1;
  int covered_corner = -1;        ///< TL, TR, BR, BL; negative: none
  Eigen::Vector2d covered{0, 0};  ///< extent of the cover from that corner inwards
  double cover_level = 0;
  Eigen::Vector2d bow{0, 0};  ///< displacement of the middle along each axis; corners stay in place
  double barrel = 0;          ///< outward displacement of the middle of each edge
  bool corner_squares = false;
  int samples = 5;  ///< of a pixel, along each axis
};

double power_law(Random& random, double low, double high) {  // density ~ r^-3, as sizes in natural images
  const double u = random.uniform();
  return 1 / std::sqrt((1 - u) / (low * low) + u / (high * high));
}

/// Opaque overlapping discs and rectangles: the edge statistics of natural images (Lee, Mumford and Huang,
/// "Occlusion models for natural images", IJCV 2001).
void paint_leaf(Canvas& canvas, Random& random) {
  const double radius = power_law(random, 4, 260);
  const double x0 = random.uniform(-40, kWidth + 40.0);
  const double y0 = random.uniform(-40, kHeight + 40.0);
  const double turn = random.uniform(0, kPi);
  const double aspect = random.uniform(0.2, 1);
  const bool round = random.uniform() < 0.4;
  const double level = std::clamp(random.normal(115, 50), 5.0, 250.0);
  const double slope_x = random.normal(0, 0.1);
  const double slope_y = random.normal(0, 0.1);
  const double grain = std::max(0.0, random.normal(0, 9));
  const double grain_turn = random.uniform(0, kPi);
  const double grain_period = random.uniform(2.5, 12);
  const double c = std::cos(turn);
  const double s = std::sin(turn);
  const int reach = static_cast<int>(radius * 1.5) + 2;
  for (int y = std::max(0, static_cast<int>(y0) - reach);
       y < std::min<int>(kHeight, static_cast<int>(y0) + reach); ++y) {
    for (int x = std::max(0, static_cast<int>(x0) - reach);
         x < std::min<int>(kWidth, static_cast<int>(x0) + reach); ++x) {
      const double dx = x + 0.5 - x0;
      const double dy = y + 0.5 - y0;
      const double u = c * dx + s * dy;
      const double v = (c * dy - s * dx) / aspect;
      const double out = round ? std::hypot(u, v) - radius : std::max(std::abs(u), std::abs(v)) - radius;
      const double cover = std::clamp(0.5 - out * aspect, 0.0, 1.0);
      if (cover <= 0) continue;
      const double wave =
          std::sin((dx * std::cos(grain_turn) + dy * std::sin(grain_turn)) * 2 * kPi / grain_period) *
          std::sin(dx * 0.37 + dy * 0.23);
      const double here = level + slope_x * dx + slope_y * dy + grain * wave;
      float& pixel = canvas.at(x, y);
      pixel += static_cast<float>(cover * (std::clamp(here, 0.0, 255.0) - pixel));
    }
  }
}

Canvas clutter(Random& random) {
  Canvas canvas;
  const double base = random.uniform(60, 180);
  std::ranges::fill(canvas.level, static_cast<float>(base));
  constexpr int kLeaves = 5000;
  for (int i = 0; i < kLeaves; ++i) paint_leaf(canvas, random);
  return canvas;
}

/// A tag with a frontal size of `size_px`, tilted by `tilt_rad` about any axis, its centre at a pixel.
TrueTag place(const TagId& tag, const Eigen::Vector2d& center_px, double size_px, double tilt_rad,
              Random& random) {
  const Eigen::Vector3d ray((center_px.x() - kWidth / 2.0) / kFocal, (center_px.y() - kHeight / 2.0) / kFocal,
                            1);
  const double about = random.uniform(0, 2 * kPi);
  const double roll = random.uniform(0, 2 * kPi);
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), ray.normalized()) *
      Eigen::Quaterniond(Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d(std::cos(about), std::sin(about), 0))) *
      Eigen::Quaterniond(Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()));
  const Eigen::Vector3d origin = ray * (kFocal / size_px);
  TrueTag truth;
  truth.tag = tag;
  truth.size_px = size_px;
  truth.tilt_deg = tilt_rad * 180 / kPi;
  const std::array<Eigen::Vector2d, 4> unit = {
      Eigen::Vector2d(-0.5, -0.5), {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d p = origin + turn * Eigen::Vector3d(unit.at(i).x(), unit.at(i).y(), 0);
    truth.corners_px.at(i) =
        Eigen::Vector2d(kFocal * p.x() / p.z() + kWidth / 2.0, kFocal * p.y() / p.z() + kHeight / 2.0);
  }
  return truth;
}

/// The point of the flat tag that is seen at (u, v) if the tag is bent. Corners stay in place.
Eigen::Vector2d unbent(const Print& print, double side, double u, double v) {
  const Eigen::Vector2d at(2 * u / side - 1, 2 * v / side - 1);
  const Eigen::Vector2d inner(1 - at.y() * at.y(), 1 - at.x() * at.x());
  return Eigen::Vector2d(u, v) - (print.bow + print.barrel * at).cwiseProduct(inner);
}

bool covers_corner(const Print& print, double side, double u, double v) {
  const int k = print.covered_corner;
  if (k < 0) return false;
  constexpr double kBeyond = 3;  // cells
  const double x = k == 1 || k == 2 ? side - u : u;
  const double y = k >= 2 ? side - v : v;
  return x > -kBeyond && y > -kBeyond && x < print.covered.x() && y < print.covered.y();
}

/// The grey level at a point of the tag's plane, or a negative number outside the paper.
double level_at(const Family& family, const std::vector<std::uint8_t>& cells, const Print& print, double at_u,
                double at_v) {
  const double side = family.width_at_border;
  const Eigen::Vector2d flat = unbent(print, side, at_u, at_v);
  const double u = flat.x();
  const double v = flat.y();
  if (u < -print.margin || v < -print.margin || u >= side + print.margin || v >= side + print.margin)
    return -1;
  const int edge = (family.total_width - family.width_at_border) / 2;
  const int x = static_cast<int>(std::floor(u)) + edge;
  const int y = static_cast<int>(std::floor(v)) + edge;
  bool white = true;
  if (x >= 0 && y >= 0 && x < family.total_width && y < family.total_width) {
    white = cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(family.total_width) +
                  static_cast<std::size_t>(x)] != 0;
  }
  if (print.corner_squares && (u < 0 || u >= side) && (v < 0 || v >= side)) white = false;
  double level = white != print.inverted ? print.white : print.black;
  level *= 1 + print.slope.x() * (u / side - 0.5) + print.slope.y() * (v / side - 0.5);
  if (print.shadow_line.dot(Eigen::Vector3d(u, v, 1)) > 0) level *= print.shadow;
  if (print.glare > 0) {
    const double r = (Eigen::Vector2d(u, v) - print.glare_at).norm() / print.glare_radius;
    level += print.glare * std::exp(-0.5 * r * r);
  }
  if (print.bar_level >= 0) {
    const std::array<double, 4> depth = {v, side - u, side - v, u};
    const double d = depth.at(static_cast<std::size_t>(print.bar_side));
    if (d >= print.bar_begin && d < print.bar_end) level = print.bar_level;
  }
  if (covers_corner(print, side, u, v)) level = print.cover_level;
  return level;
}

void paint(Canvas& canvas, const TrueTag& truth, const Print& print) {
  const int grid = print.samples;
  const Family& kind = family(truth.tag.family);
  const std::vector<std::uint8_t> cells = bitmap(truth.tag);
  const double side = kind.width_at_border;
  const Eigen::Matrix3d px_H_cell = homography_of_square(side, truth.corners_px);
  const Eigen::Matrix3d cell_H_px = px_H_cell.inverse();
  Eigen::Array2d low(1e9, 1e9);
  Eigen::Array2d high(-1e9, -1e9);
  for (const double u : {-print.margin, side + print.margin}) {
    for (const double v : {-print.margin, side + print.margin}) {
      const Eigen::Vector2d px = (px_H_cell * Eigen::Vector3d(u, v, 1)).hnormalized();
      low = low.min(px.array());
      high = high.max(px.array());
    }
  }
  for (int y = std::max(0, static_cast<int>(low.y()) - 1);
       y < std::min(kHeight, static_cast<int>(high.y()) + 2); ++y) {
    for (int x = std::max(0, static_cast<int>(low.x()) - 1);
         x < std::min(kWidth, static_cast<int>(high.x()) + 2); ++x) {
      double sum = 0;
      const double behind = canvas.at(x, y);
      for (int i = 0; i < grid; ++i) {
        for (int j = 0; j < grid; ++j) {
          const Eigen::Vector3d p =
              cell_H_px * Eigen::Vector3d(x + (i + 0.5) / grid, y + (j + 0.5) / grid, 1);
          const double level = level_at(kind, cells, print, p.x() / p.z(), p.y() / p.z());
          sum += level < 0 ? behind : level;
        }
      }
      canvas.at(x, y) = static_cast<float>(sum / (grid * grid));
    }
  }
}

void blur_lines(Canvas& canvas, double sigma, bool along_x) {
  const int reach = std::max(1, static_cast<int>(std::ceil(3.5 * sigma)));
  std::vector<float> kernel;
  float total = 0;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
    total += kernel.back();
  }
  for (float& weight : kernel) weight /= total;
  Canvas out;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      float sum = 0;
      for (int i = -reach; i <= reach; ++i) {
        const int from_x = along_x ? std::clamp(x + i, 0, kWidth - 1) : x;
        const int from_y = along_x ? y : std::clamp(y + i, 0, kHeight - 1);
        sum += kernel[static_cast<std::size_t>(i + reach)] * canvas.at(from_x, from_y);
      }
      out.at(x, y) = sum;
    }
  }
  canvas = std::move(out);
}

void smear(Canvas& canvas, double length_px, double direction_rad) {
  const int steps = static_cast<int>(std::ceil(2 * length_px)) + 1;
  Canvas out;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      float sum = 0;
      for (int i = 0; i < steps; ++i) {
        const double t = length_px * ((i + 0.5) / steps - 0.5);
        const double fx = std::clamp(x + t * std::cos(direction_rad), 0.0, kWidth - 1.001);
        const double fy = std::clamp(y + t * std::sin(direction_rad), 0.0, kHeight - 1.001);
        const int ix = static_cast<int>(fx);
        const int iy = static_cast<int>(fy);
        const auto dx = static_cast<float>(fx - ix);
        const auto dy = static_cast<float>(fy - iy);
        sum += (1 - dy) * ((1 - dx) * canvas.at(ix, iy) + dx * canvas.at(ix + 1, iy)) +
               dy * ((1 - dx) * canvas.at(ix, iy + 1) + dx * canvas.at(ix + 1, iy + 1));
      }
      out.at(x, y) = sum / static_cast<float>(steps);
    }
  }
  canvas = std::move(out);
}

Image developed(Canvas& canvas, const Look& look, Random& random) {
  blur_lines(canvas, look.blur_px, true);
  blur_lines(canvas, look.blur_px, false);
  if (look.motion_px > 0) smear(canvas, look.motion_px, look.motion_rad);
  Image image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double value = canvas.at(x, y) + random.normal(0, look.noise);
      image.row(y)[x] = static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
    }
  }
  return image;
}

struct SizeRange {
  double low_px = 20;
  double high_px = 100;
  double max_tilt_deg = 60;
};

/// Tags whose papers do not touch, as many as can be placed in `tries` attempts.
template <class MakePrint>
std::vector<TrueTag> scatter(Canvas& canvas, const SizeRange& range, int most, Random& random,
                             MakePrint&& make_print) {
  std::vector<TrueTag> placed;
  std::vector<std::pair<Eigen::Vector2d, double>> taken;
  for (int attempt = 0; attempt < 8 * most && std::ssize(placed) < most; ++attempt) {
    const double size = range.low_px * std::pow(range.high_px / range.low_px, random.uniform());
    const double tilt = random.uniform(0, range.max_tilt_deg) * kPi / 180;
    const double radius = size * 0.95;
    const double x = random.uniform(radius, kWidth - radius);
    const double y = random.uniform(radius, kHeight - radius);
    const Eigen::Vector2d center(x, y);
    if (std::ranges::any_of(
            taken, [&](const auto& other) { return (other.first - center).norm() < other.second + radius; }))
      continue;
    const TagId tag{FamilyId::Tag36h11,
                    static_cast<int>(random.index(family(FamilyId::Tag36h11).codes.size()))};
    placed.push_back(place(tag, center, size, tilt, random));
    taken.emplace_back(center, radius);
    paint(canvas, placed.back(), make_print());
  }
  return placed;
}

constexpr int kTagsPerImage = 22;
constexpr int kTagsPerPhotograph = 8;

TagImage mixed(Random& random) {
  Canvas canvas = clutter(random);
  TagImage photo;
  photo.name = "mixed";
  photo.truth = scatter(canvas, {12, 200, 75}, kTagsPerImage, random, [&] {
    Print print;
    const double contrast = random.uniform(50, 150);
    print.black = random.uniform(10, 230 - contrast);
    print.white = print.black + contrast;
    print.slope.x() = random.uniform(-0.15, 0.15);
    print.slope.y() = random.uniform(-0.15, 0.15);
    return print;
  });
  Look look;
  look.blur_px = random.uniform(0.4, 1.2);
  look.noise = random.uniform(1, 6);
  look.motion_px = random.uniform(0, 3);
  look.motion_rad = random.uniform(0, kPi);
  photo.image = developed(canvas, look, random);
  return photo;
}

/// Degradation of one image of the set "single", in addition to a blur of 0.6 px and noise of 2 grey levels.
struct Degradation {
  const char* kind;
  double amount;
  double white;
};
constexpr std::array<Degradation, 28> kDegradations = {{
    {"blur", 0.8, 0},      {"blur", 1.2, 0},      {"blur", 1.6, 0},       {"blur", 2.0, 0},
    {"blur", 1.0, 0},      {"noise", 4, 0},       {"noise", 8, 0},        {"noise", 12, 0},
    {"noise", 16, 0},      {"motion", 2, 0},      {"motion", 4, 0},       {"motion", 6, 0},
    {"motion", 8, 0},      {"motion", 3, 0},      {"contrast", 90, 140},  {"contrast", 100, 125},
    {"contrast", 10, 50},  {"contrast", 10, 28},  {"contrast", 180, 240}, {"contrast", 100, 140},
    {"occlusion", 0.7, 0}, {"occlusion", 1.5, 0}, {"occlusion", 0.7, 1},  {"occlusion", 1.5, 1},
    {"glare", 60, 0},      {"glare", 120, 0},     {"shading", 0.3, 0},    {"shading", 0.6, 0},
}};

Print print_of(const Degradation& what, Random& random) {
  Print print;
  const std::string_view kind = what.kind;
  if (kind == "contrast") {
    print.black = what.amount;
    print.white = what.white;
  }
  if (kind == "occlusion") {
    print.bar_level = what.white > 0 ? 170 : 60;
    print.bar_begin = random.uniform(-0.5, 0.3);
    print.bar_end = print.bar_begin + what.amount;
    print.bar_side = static_cast<int>(random.index(4));
  }
  if (kind == "glare") {
    print.glare = what.amount;
    print.glare_at.x() = random.uniform(0, 8);
    print.glare_at.y() = random.uniform(0, 8);
    print.glare_radius = random.uniform(1, 3);
  }
  if (kind == "shading") {
    const double direction = random.uniform(0, 2 * kPi);
    print.slope = 2 * what.amount * Eigen::Vector2d(std::cos(direction), std::sin(direction));
  }
  return print;
}

TagImage single(std::size_t index, Random& random) {
  const Degradation& what = kDegradations.at(index % kDegradations.size());
  const std::string_view kind = what.kind;
  Canvas canvas = clutter(random);
  TagImage photo;
  photo.name = fmt::format("{} {}", what.kind, what.amount);
  if (what.white > 0) photo.name += fmt::format("-{}", what.white);
  photo.truth = scatter(canvas, {}, kTagsPerImage, random, [&] { return print_of(what, random); });
  Look look;
  if (kind == "blur") look.blur_px = what.amount;
  if (kind == "noise") look.noise = what.amount;
  if (kind == "motion") {
    look.motion_px = what.amount;
    look.motion_rad = random.uniform(0, kPi);
  }
  photo.image = developed(canvas, look, random);
  return photo;
}

TagImage special(std::string_view set, Random& random) {
  Canvas canvas = clutter(random);
  TagImage photo;
  photo.name = std::string(set);
  photo.truth = scatter(canvas, {24, 120, 55}, kTagsPerImage, random, [&] {
    Print print;
    print.inverted = set == "inverted";
    if (set == "margin") print.margin = 0.25;
    if (set == "bar") {
      print.bar_level = random.uniform() < 0.5 ? 60 : 170;
      print.bar_begin = random.uniform(-0.5, 0.2);
      print.bar_end = print.bar_begin + random.uniform(0.7, 1.5);
      print.bar_side = static_cast<int>(random.index(4));
    }
    if (set == "shadow") {
      const double direction = random.uniform(0, 2 * kPi);
      const double beyond = random.uniform(-2, 2);
      print.shadow = random.uniform(0.3, 0.45);
      print.shadow_line = {std::cos(direction), std::sin(direction), 0};
      print.shadow_line.z() = -4 * (print.shadow_line.x() + print.shadow_line.y()) + beyond;
    }
    return print;
  });
  photo.image = developed(canvas, {}, random);
  return photo;
}

Eigen::Vector2d random_direction(Random& random) {
  const double direction = random.uniform(0, 2 * kPi);
  return {std::cos(direction), std::sin(direction)};
}

/// A print of one of the sets whose tags often cannot be refined.
Print hard_print(std::string_view set, Random& random) {
  Print print;
  print.black = random.uniform(20, 80);
  print.white = print.black + random.uniform(80, 150);
  if (set == "faint") print.white = print.black + random.uniform(7, 16);
  if (set == "bright") {
    print.white = random.uniform(300, 2000);
    print.samples = 16;
  }
  if (set == "corner") {
    print.covered_corner = static_cast<int>(random.index(4));
    print.covered.x() = random.uniform(0.2, 2);
    print.covered.y() = random.uniform(0.2, 2);
    print.cover_level = random.uniform(print.black, print.white);
  }
  if (set == "glare") {
    print.glare = random.uniform(50, 400);
    print.glare_at.x() = random.uniform(0, 8);
    print.glare_at.y() = random.uniform(0, 8);
    print.glare_radius = random.uniform(0.7, 3);
  }
  if (set == "bent") {
    print.bow = random.uniform(0, 0.4) * random_direction(random);
    print.barrel = random.uniform(-0.3, 0.3);
  }
  if (set == "covered") {
    print.bar_level = random.uniform(print.black, print.white);
    print.bar_begin = random.uniform(-1, 0.5);
    print.bar_end = print.bar_begin + random.uniform(0.3, 1.5);
    print.bar_side = static_cast<int>(random.index(4));
  }
  return print;
}

/// Tags at the border of the image, up to about one cell beyond it.
std::vector<TrueTag> scatter_at_border(Canvas& canvas, int most, Random& random) {
  std::vector<TrueTag> placed;
  for (int i = 0; i < most; ++i) {
    const double size = 24 * std::pow(5, random.uniform());
    const int step = i / 4;
    const int steps = (most + 3) / 4;
    const double along = (step + 0.5) / steps;
    const double inwards = random.uniform(0.3, 0.75) * size;
    const std::array<Eigen::Vector2d, 4> center = {Eigen::Vector2d(along * kWidth, inwards),
                                                   {along * kWidth, kHeight - inwards},
                                                   {inwards, along * kHeight},
                                                   {kWidth - inwards, along * kHeight}};
    const TagId tag{FamilyId::Tag36h11,
                    static_cast<int>(random.index(family(FamilyId::Tag36h11).codes.size()))};
    placed.push_back(place(tag, center.at(static_cast<std::size_t>(i % 4)), size,
                           random.uniform(0, 45) * kPi / 180, random));
    paint(canvas, placed.back(), hard_print("cut", random));
  }
  return placed;
}

/// Tags that often cannot be refined, for one cause in each set.
TagImage hard(std::string_view set, Random& random) {
  Canvas canvas = clutter(random);
  TagImage photo;
  photo.name = std::string(set);
  const SizeRange range = set == "tiny" ? SizeRange{8, 14, 70} : SizeRange{20, 120, 55};
  photo.truth = set == "cut" ? scatter_at_border(canvas, 20, random)
                             : scatter(canvas, range, set == "tiny" ? 100 : kTagsPerImage, random,
                                       [&] { return hard_print(set, random); });
  Look look;
  look.blur_px = random.uniform(0.4, 1.2);
  look.noise = set == "faint" ? random.uniform(0.5, 1.5) : random.uniform(1, 4);
  if (set == "moving") {
    look.motion_px = random.uniform(3, 10);
    look.motion_rad = random.uniform(0, kPi);
  }
  photo.image = developed(canvas, look, random);
  return photo;
}

/// A board of 6 x 4 tags on one paper, with black squares between the corners.
TagImage grid(Random& random) {
  Canvas canvas = clutter(random);
  TagImage photo;
  photo.name = "grid";
  const double size = random.uniform(26, 70);
  const double tilt = random.uniform(0, 50) * kPi / 180;
  // The plane of the board is that of one large tag; 10 cells per tag: 8 of the tag, 2 of the gap.
  const double x = random.uniform(400, 880);
  const double y = random.uniform(280, 440);
  const TrueTag plane = place({}, {x, y}, size, tilt, random);
  const Eigen::Matrix3d px_H_cell = homography_of_square(8, plane.corners_px);
  for (int row = -2; row < 2; ++row) {
    for (int column = -3; column < 3; ++column) {
      const auto number = static_cast<int>(random.index(family(FamilyId::Tag36h11).codes.size()));
      TrueTag truth = plane;
      truth.tag = {FamilyId::Tag36h11, number};
      const std::array<Eigen::Vector2d, 4> unit = {Eigen::Vector2d(0, 0), {8, 0}, {8, 8}, {0, 8}};
      for (std::size_t i = 0; i < 4; ++i) {
        const Eigen::Vector2d cell = unit.at(i) + 10.0 * Eigen::Vector2d(column, row);
        truth.corners_px.at(i) = (px_H_cell * cell.homogeneous()).hnormalized();
      }
      Print print;
      print.margin = 2;
      print.corner_squares = true;
      const bool inside = std::ranges::all_of(truth.corners_px, [&](const Eigen::Vector2d& corner) {
        return corner.x() > size / 3 && corner.y() > size / 3 && corner.x() < kWidth - size / 3 &&
               corner.y() < kHeight - size / 3;
      });
      if (!inside) continue;
      paint(canvas, truth, print);
      photo.truth.push_back(truth);
    }
  }
  photo.image = developed(canvas, {}, random);
  return photo;
}

/// Paper that is much brighter than the range of the image, behind a lens with a wide blur.
TagImage overexposed(std::size_t index, Random& random) {
  constexpr std::array<double, 3> kWhites = {600, 800, 1200};
  Canvas canvas = clutter(random);
  Print print;
  print.black = 60;
  print.white = kWhites.at(index % kWhites.size());
  print.samples = 16;  // with 5, errors of the edges would exceed the noise
  TagImage photo;
  photo.name = fmt::format("overexposed {}", print.white);
  photo.truth = scatter(canvas, {40, 70, 45}, kTagsPerImage, random, [&] { return print; });
  Look look;
  look.blur_px = 1.2;
  look.noise = 1.5;
  photo.image = developed(canvas, look, random);
  return photo;
}

/// The middle of an image, reduced to the size of the canvas by averaging.
Canvas reduced(const Image& image) {
  Canvas canvas;
  const double scale = std::min(image.width() / double{kWidth}, image.height() / double{kHeight});
  const double x0 = 0.5 * (image.width() - scale * kWidth);
  const double y0 = 0.5 * (image.height() - scale * kHeight);
  const auto range = [scale](double from, int i, int size) {
    const int first = std::clamp(static_cast<int>(from + scale * i), 0, size - 1);
    return std::pair(first, std::clamp(static_cast<int>(from + scale * (i + 1)), first + 1, size));
  };
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const auto [left, right] = range(x0, x, image.width());
      const auto [top, bottom] = range(y0, y, image.height());
      int sum = 0;
      for (int j = top; j < bottom; ++j)
        for (int i = left; i < right; ++i) sum += image.row(j)[i];
      canvas.at(x, y) = static_cast<float>(sum) / static_cast<float>((right - left) * (bottom - top));
    }
  }
  return canvas;
}

Random stream(std::string_view set, std::size_t index, std::uint64_t seed) {
  std::uint64_t hash = 14695981039346656037U ^ seed;
  for (const char letter : set) hash = (hash ^ static_cast<std::uint8_t>(letter)) * 1099511628211U;
  return Random(hash + 7919 * index);
}

}  // namespace

const std::vector<TagSet>& tag_sets() {
  static const std::vector<TagSet> sets = {{"mixed", 40},   {"single", 84},     {"grid", 8},
                                           {"shadow", 8},   {"bar", 8},         {"margin", 8},
                                           {"inverted", 8}, {"overexposed", 12}};
  return sets;
}

const std::vector<TagSet>& hard_tag_sets() {
  static const std::vector<TagSet> sets = {{"tiny", 4},    {"faint", 4},  {"corner", 4},
                                           {"glare", 4},   {"bent", 4},   {"cut", 4},
                                           {"covered", 4}, {"moving", 4}, {"bright", 4}};
  return sets;
}

TagImage tag_image(std::string_view set, std::size_t index, std::uint64_t seed) {
  Random random = stream(set, index, seed);
  if (set == "mixed") return mixed(random);
  if (set == "single") return single(index, random);
  if (set == "grid") return grid(random);
  if (set == "overexposed") return overexposed(index, random);
  if (std::ranges::any_of(hard_tag_sets(), [&](const TagSet& one) { return one.name == set; }))
    return hard(set, random);
  return special(set, random);
}

Image tag_free_image(std::size_t index, std::uint64_t seed) {
  Random random = stream("tag free", index, seed);
  Canvas canvas = clutter(random);
  return developed(canvas, {}, random);
}

TagImage tags_on_photograph(const Image& photograph, std::size_t index, std::uint64_t seed) {
  Random random = stream("photograph", index, seed);
  Canvas canvas = reduced(photograph);
  TagImage photo;
  photo.name = "tags on a photograph";
  photo.truth = scatter(canvas, {24, 160, 60}, kTagsPerPhotograph, random, [&] {
    Print print;
    const double contrast = random.uniform(90, 160);
    print.black = random.uniform(15, 60);
    print.white = print.black + contrast;
    print.slope.x() = random.uniform(-0.1, 0.1);
    print.slope.y() = random.uniform(-0.1, 0.1);
    return print;
  });
  photo.image = developed(canvas, {}, random);
  return photo;
}

}  // namespace waymark::testing
