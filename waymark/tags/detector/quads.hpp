#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "waymark/image/image.hpp"
#include "waymark/tags/detector/components.hpp"

namespace waymark::search {

/// Corners in clockwise order in the image, in pixels; pixel centres are at +1/2.
using Quad = std::array<Eigen::Vector2f, 4>;

/// Twice the area of the triangle a b c, positive if clockwise in the image.
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

/// The points p with normal . p = offset.
struct Line {
  Eigen::Vector2d normal{0, 0};
  double offset = 0;
};

/// Finds the intersection of two lines. Returns false if they are parallel.
bool intersect(const Line& a, const Line& b, Eigen::Vector2f& point);

/// The quad formed by the convex hull of a component, if the hull is one. Serves as a workspace: does not
/// allocate once it has grown.
class QuadFitter {
 public:
  /// Returns false if the hull is not a quad or the component is not a frame around something. O(rows +
  /// runs).
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

/// Parameters of the edge search.
struct EdgeSearch {
  float reach_px = 2;  ///< to either side of the edge
  int sign = 1;        ///< 1 if it is brighter outside the quad, -1 if darker
  int crossings = 20;  ///< minimum number of samples per edge; at most twice as many are taken
  /// Fits the line to the majority of the crossings, so that disturbed ones are excluded.
  bool majority = false;
};

/// Moves the four edges to the strongest change in the image (lines through the means of the squared
/// gradients across them) and intersects them. Returns false and leaves `quad` unchanged if an edge is not
/// visible or a corner moved too far.
bool sharpen_edges(const ImageView& image, const EdgeSearch& search, Quad& quad);

}  // namespace waymark::search
