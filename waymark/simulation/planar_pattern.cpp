#include "waymark/simulation/planar_pattern.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <variant>

namespace waymark::photo {
namespace {

constexpr double kChordTolerancePx = 1e-4;
constexpr double kLongestChordPx = 16;  // under distortion: short enough that no bend hides between two tests
constexpr int kMaxEdgeHalvings = 16;
constexpr int kMaxRectHalvings = 12;
constexpr double kFarthestPx = 1e6;  // beyond, the crossing of an edge and the image loses digits

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

/// Projects the rectangles of one pattern.
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
    if (!px || px->cwiseAbs().maxCoeff() > kFarthestPx) return std::nullopt;
    return Point{cam_p, *px};
  }

  /// Certainly: the sphere around the rectangle lies beyond the cone the camera sees.
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

  /// The points between a and b (both not included) that an edge needs to follow its image.
  bool add_bend(const Point& a, const Point& b, int halvings) {
    const auto middle = project((a.cam_p + b.cam_p) / 2);
    if (!middle) return false;
    const double bend = distance_from_line(middle->px, a.px, b.px);
    const bool follows = bend < kChordTolerancePx && (b.px - a.px).norm() < kLongestChordPx;
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

}  // namespace waymark::photo
