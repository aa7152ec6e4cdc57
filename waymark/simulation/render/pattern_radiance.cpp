#include "waymark/simulation/render/pattern_radiance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <variant>

namespace waymark::photo {

void Coverage::reset(int width, int height) {
  width_ = width;
  height_ = height;
  cells_.assign(static_cast<std::size_t>(width + 1) * static_cast<std::size_t>(height), Cell{});
}

void Coverage::add(std::span<const Eigen::Vector2d> corners, double value) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    add_edge(corners[i], corners[i + 1 < corners.size() ? i + 1 : 0], value);
  }
}

void Coverage::add_edge(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double value) {
  const bool downwards =
      from.y() < to.y();  // an edge on the right of a clockwise polygon subtracts the area to its right
  const Eigen::Vector2d& top = downwards ? from : to;
  const Eigen::Vector2d& bottom = downwards ? to : from;
  const double y_begin = std::max(top.y(), 0.0);
  const double y_end = std::min(bottom.y(), static_cast<double>(height_));
  if (!(y_begin < y_end)) return;
  const double slope = (bottom.x() - top.x()) / (bottom.y() - top.y());
  const double sign = downwards ? -1.0 : 1.0;
  for (int y = static_cast<int>(y_begin); y < height_ && y < y_end; ++y) {
    const double begin = std::max(y_begin, static_cast<double>(y));
    const double end = std::min(y_end, y + 1.0);
    add_in_row(y, top.x() + (begin - top.y()) * slope, top.x() + (end - top.y()) * slope,
               sign * (end - begin), value);
  }
}

/// Adds the part of an edge inside row y, from x_from to x_to, over a height of |height|. The sign of
/// `height` is that of the edge.
void Coverage::add_in_row(int y, double x_from, double x_to, double height, double value) {
  const double right_end = width_;
  const double left = std::clamp(std::min(x_from, x_to), 0.0, right_end);
  const double right = std::clamp(std::max(x_from, x_to), 0.0, right_end);
  if (std::min(x_from, x_to) >= right_end) return;
  const double length = std::abs(x_to - x_from);
  if (length < 1e-12) {  // vertical
    const int x = static_cast<int>(left);
    const double beside = left - x;
    add_area(y, x, height * (1 - beside), value);
    add_area(y, x + 1, height * beside, value);
    return;
  }
  const double per_x = height / length;
  const double outside_left = std::max(0.0, -std::min(x_from, x_to)) - std::max(0.0, -std::max(x_from, x_to));
  add_area(y, 0, per_x * outside_left, value);  // left of the grid: covers its rows from the first cell on
  for (int x = static_cast<int>(left); x < width_ && x < right; ++x) {
    const double begin = std::max(left, static_cast<double>(x));
    const double end = std::min(right, x + 1.0);
    const double piece = per_x * (end - begin);
    const double beside = (begin + end) / 2 - x;
    add_area(y, x, piece * (1 - beside), value);
    add_area(y, x + 1, piece * beside, value);
  }
}

void Coverage::add_area(int y, int x, double area, double value) {
  if (x > width_) return;
  Cell& cell = cells_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1) +
                      static_cast<std::size_t>(x)];
  cell.covered += area;
  cell.value += area * value;
}

std::span<const Coverage::Cell> Coverage::finish_row(int y) {
  const auto width = static_cast<std::size_t>(width_);
  const std::span<Cell> row(cells_.data() + static_cast<std::size_t>(y) * (width + 1), width);
  Cell sum;
  for (Cell& cell : row) {
    sum.covered += cell.covered;
    sum.value += cell.value;
    cell = sum;
  }
  return row;
}

namespace {

constexpr double kChordTolerancePx = 1e-4;
constexpr double kMaxChordPx = 16;  // under distortion; short enough for the tests to detect every curve
constexpr int kMaxEdgeHalvings = 16;
constexpr int kMaxRectHalvings = 12;
constexpr double kMaxCoordinatePx = 1e6;  // larger coordinates lose digits when intersected with the image

bool keeps_lines_straight(const CameraModel& camera) {
  const auto* pinhole = std::get_if<PinholeRadtan>(&camera.projection());
  return pinhole != nullptr &&
         std::all_of(pinhole->k.begin(), pinhole->k.end(), [](double k) { return k == 0; });
}

double distance_from_line(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const Eigen::Vector2d off = p - a;
  const double length = along.norm();
  return length > 0 ? std::abs(along.x() * off.y() - along.y() * off.x()) / length : off.norm();
}

/// Projects the rectangles of a single pattern.
class Projector {
 public:
  Projector(const CameraModel& camera, const SE3& cam_T_plane, bool clockwise)
      : camera_(camera),
        cam_R_plane_(cam_T_plane.rotation().matrix()),
        cam_t_plane_(cam_T_plane.translation()),
        clockwise_(clockwise),
        straight_(keeps_lines_straight(camera)) {
    out_.min_px.setConstant(std::numeric_limits<double>::infinity());
    out_.max_px = -out_.min_px;
  }

  void add(const PatternRect& rect, int halvings = 0) {
    if (is_out_of_domain(rect)) return;
    const std::size_t begin = out_.corners_px.size();
    if (add_outline(rect)) {
      finish_piece(begin, rect.level);
      return;
    }
    out_.corners_px.resize(begin);
    if (halvings >= kMaxRectHalvings) return;
    PatternRect first = rect;
    PatternRect second = rect;
    if (rect.right - rect.left > rect.bottom - rect.top) {
      first.right = second.left = (rect.left + rect.right) / 2;
    } else {
      first.bottom = second.top = (rect.top + rect.bottom) / 2;
    }
    add(first, halvings + 1);
    add(second, halvings + 1);
  }

  ProjectedPattern take() { return std::move(out_); }

 private:
  struct Point {
    Eigen::Vector3d cam_p;
    Eigen::Vector2d px;
  };

  [[nodiscard]] Eigen::Vector3d in_camera(double x, double y) const {
    return cam_t_plane_ + cam_R_plane_.col(0) * x + cam_R_plane_.col(1) * y;
  }

  [[nodiscard]] std::optional<Point> project(const Eigen::Vector3d& cam_p) const {
    const auto px = camera_.project(cam_p);
    if (!px || px->cwiseAbs().maxCoeff() > kMaxCoordinatePx) return std::nullopt;
    return Point{cam_p, *px};
  }

  /// True only if the bounding sphere of the rectangle is outside the camera's viewing cone.
  [[nodiscard]] bool is_out_of_domain(const PatternRect& rect) const {
    const Eigen::Vector3d centre = in_camera((rect.left + rect.right) / 2, (rect.top + rect.bottom) / 2);
    const double radius = std::hypot(rect.right - rect.left, rect.bottom - rect.top) / 2;
    const double distance = centre.norm();
    if (distance <= radius) return false;
    const double from_axis = std::atan2(centre.head<2>().norm(), centre.z());
    return from_axis - std::asin(radius / distance) > camera_.max_angle_rad();
  }

  bool add_outline(const PatternRect& rect) {
    std::array<Eigen::Vector2d, 4> ring = {
        Eigen::Vector2d(rect.left, rect.top), Eigen::Vector2d(rect.right, rect.top),
        Eigen::Vector2d(rect.right, rect.bottom), Eigen::Vector2d(rect.left, rect.bottom)};
    if (!clockwise_) std::reverse(ring.begin(), ring.end());
    std::array<Point, 4> corners;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const auto corner = project(in_camera(ring[i].x(), ring[i].y()));
      if (!corner) return false;
      corners[i] = *corner;
    }
    for (std::size_t i = 0; i < ring.size(); ++i) {
      out_.corners_px.push_back(corners[i].px);
      if (!straight_ && !add_bend(corners[i], corners[(i + 1) % 4], 0)) return false;
    }
    return true;
  }

  /// Adds the intermediate points between a and b (excluding both) with which an edge follows its curved
  /// image.
  bool add_bend(const Point& a, const Point& b, int halvings) {
    const auto middle = project((a.cam_p + b.cam_p) / 2);
    if (!middle) return false;
    const double bend = distance_from_line(middle->px, a.px, b.px);
    const bool follows = bend < kChordTolerancePx && (b.px - a.px).norm() < kMaxChordPx;
    if (follows || halvings >= kMaxEdgeHalvings) return true;
    if (!add_bend(a, *middle, halvings + 1)) return false;
    out_.corners_px.push_back(middle->px);
    return add_bend(*middle, b, halvings + 1);
  }

  void finish_piece(std::size_t begin, double level) {
    ProjectedPattern::Piece piece{begin, out_.corners_px.size(), level};
    Eigen::Vector2d low = out_.corners_px[begin];
    Eigen::Vector2d high = low;
    for (std::size_t i = begin + 1; i < piece.end; ++i) {
      low = low.cwiseMin(out_.corners_px[i]);
      high = high.cwiseMax(out_.corners_px[i]);
    }
    piece.y_min = low.y();
    piece.y_max = high.y();
    out_.pieces.push_back(piece);
    out_.min_px = out_.min_px.cwiseMin(low);
    out_.max_px = out_.max_px.cwiseMax(high);
  }

  const CameraModel& camera_;
  Eigen::Matrix3d cam_R_plane_;
  Eigen::Vector3d cam_t_plane_;
  bool clockwise_;
  bool straight_;
  ProjectedPattern out_;
};

}  // namespace

std::vector<PatternRect> merged_cells(const PlanarPattern& pattern) {
  const Image& levels = pattern.levels;
  const auto width = static_cast<std::size_t>(levels.width());
  std::vector<PatternRect> rects;
  for (int top = 0, bottom = 0; top < levels.height(); top = bottom) {
    const std::uint8_t* row = levels.row(top);
    bottom = top + 1;
    while (bottom < levels.height() && std::memcmp(row, levels.row(bottom), width) == 0) ++bottom;
    const double y_top = pattern.y_lines_m[static_cast<std::size_t>(top)];
    const double y_bottom = pattern.y_lines_m[static_cast<std::size_t>(bottom)];
    for (std::size_t left = 0, right = 0; left < width; left = right) {
      while (right < width && row[right] == row[left]) ++right;
      rects.push_back({pattern.x_lines_m[left], y_top, pattern.x_lines_m[right], y_bottom,
                       static_cast<double>(row[left])});
    }
  }
  return rects;
}

ProjectedPattern project_pattern(const CameraModel& camera, const PlanarPattern& pattern) {
  constexpr double kPaper = 255;
  const bool front = pattern.faces_camera();
  Projector projector(camera, pattern.cam_T_plane, front);
  if (front) {
    for (const PatternRect& rect : merged_cells(pattern)) projector.add(rect);
  } else {
    projector.add({pattern.x_lines_m.front(), pattern.y_lines_m.front(), pattern.x_lines_m.back(),
                   pattern.y_lines_m.back(), kPaper});
  }
  return projector.take();
}

namespace {

/// Integral from minus infinity to x of the normal distribution function with standard deviation sigma.
double integral_of_cdf(double x, double sigma) {
  const double z = x / sigma;
  const double cdf = 0.5 * std::erfc(-z / std::numbers::sqrt2);
  const double density = std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
  return x * cdf + sigma * density;
}

/// Integral of box * Gaussian from minus infinity to u.
double gathered_up_to(double u, double sigma) {
  return integral_of_cdf(u + 0.5, sigma) - integral_of_cdf(u - 0.5, sigma);
}

}  // namespace

PointSpread point_spread(double sigma_px) {
  constexpr double kNoLens = 0.05;
  if (sigma_px < kNoLens) return {.cells_per_px = 1, .reach_px = 0, .weights = {1.0}};
  constexpr double kCellsPerSigma = 5;
  constexpr double kReachInSigmas = 5;
  PointSpread spread;
  spread.cells_per_px = std::clamp(static_cast<int>(std::ceil(kCellsPerSigma / sigma_px)), 2, 16);
  spread.reach_px = static_cast<int>(std::ceil(kReachInSigmas * sigma_px));
  const int n = spread.cells_per_px;
  const double sigma = std::sqrt(sigma_px * sigma_px - 1.0 / (6.0 * n * n));
  const int count = n * (1 + 2 * spread.reach_px);
  double sum = 0;
  for (int k = 0; k < count; ++k) {
    // By symmetry, computed from the left half, where the difference between the two integrals keeps its
    // precision.
    const double left = static_cast<double>(std::min(k, count - 1 - k)) / n - 0.5 - spread.reach_px;
    spread.weights.push_back(gathered_up_to(left + 1.0 / n, sigma) - gathered_up_to(left, sigma));
    sum += spread.weights.back();
  }
  for (double& weight : spread.weights) weight /= sum;
  return spread;
}

namespace {

/// Whole pixels [x_begin, x_end) x [y_begin, y_end).
struct Window {
  int x_begin = 0, y_begin = 0, x_end = 0, y_end = 0;

  [[nodiscard]] bool empty() const { return x_begin >= x_end || y_begin >= y_end; }
  [[nodiscard]] int width() const { return x_end - x_begin; }
  [[nodiscard]] int height() const { return y_end - y_begin; }
};

Window overlap(const Window& a, const Window& b) {
  return {std::max(a.x_begin, b.x_begin), std::max(a.y_begin, b.y_begin), std::min(a.x_end, b.x_end),
          std::min(a.y_end, b.y_end)};
}

/// Bounding box of a pattern in pixels; coordinates are below 1e6 by construction.
Window window_of(const ProjectedPattern& pattern) {
  if (pattern.pieces.empty()) return {};
  return {static_cast<int>(std::floor(pattern.min_px.x())), static_cast<int>(std::floor(pattern.min_px.y())),
          static_cast<int>(std::ceil(pattern.max_px.x())), static_cast<int>(std::ceil(pattern.max_px.y()))};
}

/// Rows of cells with two interleaved numbers each: covered fraction and level.
class RadianceRows {
 public:
  RadianceRows(int cells, int rows)
      : stride_(2 * static_cast<std::size_t>(cells)), values_(stride_ * static_cast<std::size_t>(rows)) {}
  [[nodiscard]] std::span<float> row(int y) {
    return {values_.data() + static_cast<std::size_t>(y) * stride_, stride_};
  }
  [[nodiscard]] std::span<const float> row(int y) const {
    return {values_.data() + static_cast<std::size_t>(y) * stride_, stride_};
  }

 private:
  std::size_t stride_;
  std::vector<float> values_;
};

/// A band of pixel rows, integrated from a finer grid that extends beyond it by the reach of the lens blur.
class Band {
 public:
  Band(const Window& pixels, const PointSpread& spread)
      : pixels_(pixels),
        spread_(spread),
        n_(spread.cells_per_px),
        grid_({pixels.x_begin - spread.reach_px, pixels.y_begin - spread.reach_px,
               pixels.x_end + spread.reach_px, pixels.y_end + spread.reach_px}),
        cells_(grid_.width() * n_, grid_.height() * n_) {}

  /// Draws a pattern over the current contents.
  void add(const ProjectedPattern& pattern, Coverage& coverage) {
    const Window part = overlap(grid_, window_of(pattern));
    if (part.empty()) return;
    coverage.reset(part.width() * n_, part.height() * n_);
    const Eigen::Vector2d origin(part.x_begin, part.y_begin);
    std::vector<Eigen::Vector2d> corners;
    for (const ProjectedPattern::Piece& piece : pattern.pieces) {
      if (piece.y_max <= part.y_begin || piece.y_min >= part.y_end) continue;
      corners.clear();
      for (std::size_t i = piece.begin; i < piece.end; ++i) {
        corners.emplace_back((pattern.corners_px[i] - origin) * n_);
      }
      coverage.add(corners, piece.level);
    }
    for (int y = 0; y < coverage.height(); ++y) lay_row(part, y, coverage.finish_row(y));
  }

  /// Integrates the radiance of the band's pixels, first down the columns, then along the rows.
  void gather(SceneRadiance& radiance) const {
    const RadianceRows columns = gather_columns();
    for (int y = 0; y < pixels_.height(); ++y) {
      const float* from = columns.row(y).data();
      for (int x = 0; x < pixels_.width(); ++x, from += 2 * n_) {
        double covered = 0;
        double level = 0;
        const float* cell = from;
        for (const double weight : spread_.weights) {
          covered += weight * static_cast<double>(*cell++);
          level += weight * static_cast<double>(*cell++);
        }
        const std::size_t to = radiance.index(pixels_.x_begin + x, pixels_.y_begin + y);
        radiance.covered[to] = static_cast<float>(std::clamp(covered, 0.0, 1.0));
        radiance.level[to] = static_cast<float>(std::clamp(level, 0.0, 255.0));
      }
    }
  }

 private:
  /// Nearer paper replaces farther cells, cell by cell.
  void lay_row(const Window& part, int y, std::span<const Coverage::Cell> row) {
    const std::span<float> cells = cells_.row((part.y_begin - grid_.y_begin) * n_ + y);
    float* to = cells.data() + 2 * n_ * (part.x_begin - grid_.x_begin);
    for (const Coverage::Cell& cell : row) {
      const auto open = static_cast<float>(1 - cell.covered);
      *to = *to * open + static_cast<float>(cell.covered);
      ++to;
      *to = *to * open + static_cast<float>(cell.value);
      ++to;
    }
  }

  /// One row for each pixel row, still made of fine cells. This takes almost all of the time, so the inner
  /// loop accesses memory sequentially.
  [[nodiscard]] RadianceRows gather_columns() const {
    RadianceRows columns(grid_.width() * n_, pixels_.height());
    for (int y = 0; y < pixels_.height(); ++y) {
      const std::span<float> to = columns.row(y);
      for (std::size_t k = 0; k < spread_.weights.size(); ++k) {
        const auto weight = static_cast<float>(spread_.weights[k]);
        const float* from = cells_.row(y * n_ + static_cast<int>(k)).data();
        for (float& sum : to) sum += weight * *from++;
      }
    }
    return columns;
  }

  Window pixels_;
  const PointSpread& spread_;
  int n_;
  Window grid_;
  RadianceRows cells_;
};

/// The columns of a strip that are covered by patterns, as disjoint runs, so that gaps cost no time.
std::vector<Window> lit_parts(std::span<const ProjectedPattern> patterns, const Window& strip, int reach) {
  std::vector<Window> parts;
  for (const ProjectedPattern& pattern : patterns) {
    const Window touched = window_of(pattern);
    if (touched.empty()) continue;
    Window part = overlap(strip, {touched.x_begin - reach, touched.y_begin - reach, touched.x_end + reach,
                                  touched.y_end + reach});
    if (part.empty()) continue;
    part.y_begin = strip.y_begin;
    part.y_end = strip.y_end;
    parts.push_back(part);
  }
  std::sort(parts.begin(), parts.end(),
            [](const Window& a, const Window& b) { return a.x_begin < b.x_begin; });
  std::vector<Window> runs;
  for (const Window& part : parts) {
    if (runs.empty() || part.x_begin > runs.back().x_end) {
      runs.push_back(part);
    } else {
      runs.back().x_end = std::max(runs.back().x_end, part.x_end);
    }
  }
  return runs;
}

}  // namespace

SceneRadiance gather_radiance(std::span<const ProjectedPattern> patterns, int width_px, int height_px,
                              const PointSpread& spread) {
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  SceneRadiance radiance{width_px, height_px, std::vector<float>(pixels), std::vector<float>(pixels)};
  const int strip_height = std::max(16, 2 * spread.reach_px);
  Coverage coverage;
  for (int y = 0; y < height_px; y += strip_height) {
    const Window strip{0, y, width_px, std::min(y + strip_height, height_px)};
    for (const Window& part : lit_parts(patterns, strip, spread.reach_px)) {
      Band band(part, spread);
      for (const ProjectedPattern& pattern : patterns) band.add(pattern, coverage);
      band.gather(radiance);
    }
  }
  return radiance;
}

}  // namespace waymark::photo
