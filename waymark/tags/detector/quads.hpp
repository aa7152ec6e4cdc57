#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "waymark/image/image.hpp"
#include "waymark/tags/detector/components.hpp"

namespace waymark::search {

/// Corners clockwise as seen in the image, in pixels with centres at +1/2.
using Quad = std::array<Eigen::Vector2f, 4>;

/// Twice the area of the triangle a b c, positive when they run clockwise as seen in the image.
[[nodiscard]] inline float cross_at(const Eigen::Vector2f& a, const Eigen::Vector2f& b,
                                    const Eigen::Vector2f& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}
[[nodiscard]] inline float area(const Quad& quad) {
  return 0.5F * (cross_at(quad[0], quad[1], quad[2]) + cross_at(quad[0], quad[2], quad[3]));
}

/// A corner between pixels.
struct HullPoint {
  std::int32_t x = 0, y = 0;
};

/// Points p with normal . p = offset.
struct Line {
  Eigen::Vector2d normal{0, 0};
  double offset = 0;
};

/// Where two lines meet. False where they are parallel.
bool intersect(const Line& a, const Line& b, Eigen::Vector2f& point);

/// The quad that a component's convex hull is, if it is one. A workspace: no allocation once it has grown.
class QuadFitter {
 public:
  /// False where the hull is no quad, or the component no frame with something in it. O(rows + runs).
  bool fit(const RunComponents& components, const Component& component, Quad& quad);

 private:
  void make_hull(const RunComponents& components, const Component& component);
  [[nodiscard]] double hull_area() const;
  [[nodiscard]] int farthest(int from, int to) const;
  [[nodiscard]] int farthest_from(const HullPoint& from) const;
  [[nodiscard]] Line side(int from, int to) const;
  bool choose_corners(std::array<int, 4>& corner) const;
  bool fit_sides(const std::array<int, 4>& corner, double hull_area, Quad& quad) const;

  std::vector<std::int32_t> left_, right_;
  std::vector<HullPoint> left_chain_, hull_;
};

/// How edges are searched.
struct EdgeSearch {
  float reach_px = 2;  ///< to both sides of the edge
  int sign = 1;        ///< 1: brighter outside the quad, -1: darker
  int crossings = 20;  ///< of one edge that are looked at, or up to twice as many
  /// The line is that of most crossings, where something pulls the others aside.
  bool majority = false;
};

/// Moves the four edges to where the image changes most (lines through the means of the squared gradients
/// across them) and intersects them. False where an edge is not seen or a corner moved too far: `quad` is
/// then as it was.
bool sharpen_edges(const ImageView& image, const EdgeSearch& search, Quad& quad);

}  // namespace waymark::search
