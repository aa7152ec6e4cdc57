#include "waymark/tags/inner_bits.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "waymark/tags/bit_cells.hpp"

namespace waymark::refinement {
namespace {

using Eigen::Vector2d;

constexpr double kRimCells = 0.6;  ///< nearer to the border edges their own fit looks

/// A pixel among the cells.
struct Place {
  std::array<double, 2> cell{};         ///< u, v
  std::array<double, 2> px_per_cell{};  ///< across the lines u = const, v = const
};

Place locate(const Eigen::Matrix3d& cell_H_px, const Vector2d& px) {
  const Eigen::Vector3d h = cell_H_px * px.homogeneous();
  Place place;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto row = static_cast<Eigen::Index>(axis);
    place.cell[axis] = h[row] / h[2];
    const Eigen::RowVector2d slope =
        cell_H_px.block<1, 2>(row, 0) - place.cell[axis] * cell_H_px.block<1, 2>(2, 0);
    place.px_per_cell[axis] = std::abs(h[2]) / slope.norm();
  }
  return place;
}

double along(double cell, int cells) { return 2.0 * cell / cells - 1.0; }

/// How far the lens and the bends of the four edges that were fitted move what is printed at (s, t) [px].
Vector2d bend_px(const TagBands& tag, const TagEstimate& estimate, double s, double t) {
  const auto of = [&](std::size_t k, double at) -> Vector2d {
    return (1 - at * at) * estimate.edges[k][kBend] * tag.edges[k].normal;
  };
  const Vector2d lens = tag.lens ? tag.lens->at(s, t) : Vector2d::Zero();
  return lens + 0.5 * ((1 - t) * of(0, s) + (1 + t) * of(2, -s) + (1 + s) * of(1, t) + (1 - s) * of(3, -t));
}

bool bends_matter(const TagBands& tag, const TagEstimate& estimate) {
  constexpr double kLittlePx = 0.02;
  if (tag.lens)
    for (const Vector2d& off : tag.lens->off_px)
      if (off.cwiseAbs().maxCoeff() > kLittlePx) return true;
  for (std::size_t k = 0; k < 4; ++k) {
    if (std::abs(estimate.edges[k][kBend]) > kLittlePx) return true;
  }
  return false;
}

double area_px2(const TagBands& tag) {
  double twice = 0;
  for (const EdgeFrame& edge : tag.edges) twice += edge.from.x() * edge.to.y() - edge.from.y() * edge.to.x();
  return 0.5 * twice;
}

/// All pixels of the tag, or `most` spread over it (Roberts, "The unreasonable effectiveness of quasirandom
/// sequences", 2018).
template <class Visit>
void each_pixel(const TagBands& tag, int cells, int most, const Visit& visit) {
  if (area_px2(tag) < 1.9 * most) {
    Vector2d low = tag.edges[0].from;
    Vector2d high = low;
    for (const EdgeFrame& edge : tag.edges) {
      low = low.cwiseMin(edge.from);
      high = high.cwiseMax(edge.from);
    }
    for (int y = static_cast<int>(low.y()); y < high.y(); ++y)
      for (int x = static_cast<int>(low.x()); x < high.x(); ++x) visit(x, y);
    return;
  }
  const Eigen::Matrix3d px_H_cell = tag.edges[0].cell_H_px.inverse();
  const double side = cells - 2 * kRimCells;
  for (int i = 1; i <= most; ++i) {
    const double u = kRimCells + side * std::fmod(0.7548776662466927 * i, 1.0);
    const double v = kRimCells + side * std::fmod(0.5698402909980532 * i, 1.0);
    const Vector2d px = (px_H_cell * Eigen::Vector3d(u, v, 1)).hnormalized();
    visit(static_cast<int>(std::floor(px.x())), static_cast<int>(std::floor(px.y())));
  }
}

/// Puts a pixel into its lane; false where a cell around it is not known.
bool put(const BitCells& pattern, const Place& place, int cells, int lane, InnerPixels::Block& block) {
  std::array<int, 2> first{};  // of the three lines
  for (std::size_t axis = 0; axis < 2; ++axis) {
    first[axis] = static_cast<int>(std::lround(place.cell[axis])) - 1;
    block.px_per_cell[axis][lane] = static_cast<float>(place.px_per_cell[axis]);
    for (std::size_t i = 0; i < 3; ++i) {
      const int line = first[axis] + static_cast<int>(i);
      block.past_px[axis][i][lane] = static_cast<float>((place.cell[axis] - line) * place.px_per_cell[axis]);
      block.place[axis][i][lane] = static_cast<float>(along(line, cells));
    }
  }
  for (std::size_t row = 0; row < 4; ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      const float white =
          pattern.at(first[0] - 1 + static_cast<int>(column), first[1] - 1 + static_cast<int>(row));
      if (white != 0.0F && white != 1.0F) return false;
      block.white[row][column][lane] = white;
    }
  }
  block.s[lane] = static_cast<float>(along(place.cell[0], cells));
  block.t[lane] = static_cast<float>(along(place.cell[1], cells));
  return true;
}

}  // namespace

void read_inner_pixels(const ImageView& image, const TagId& id, const TagBands& tag,
                       const TagEstimate& estimate, int most, InnerPixels& pixels) {
  const int cells = family(id.family).width_at_border;
  const BitCells pattern(id);
  const bool bent = bends_matter(tag, estimate);
  const Eigen::Matrix3d& cell_H_px = tag.edges[0].cell_H_px;
  const Vector2d middle =
      0.25 * (tag.edges[0].from + tag.edges[1].from + tag.edges[2].from + tag.edges[3].from);
  pixels.count = 0;
  each_pixel(tag, cells, most, [&](int x, int y) {
    if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
    if (pixels.count == InnerPixels::kMostBlocks * kLanes) return;
    const Vector2d px(x + 0.5, y + 0.5);
    Place place = locate(cell_H_px, px);
    const auto inside = [&](double c) { return c > kRimCells && c < cells - kRimCells; };
    if (!inside(place.cell[0]) || !inside(place.cell[1])) return;
    if (bent)
      place = locate(cell_H_px,
                     px - bend_px(tag, estimate, along(place.cell[0], cells), along(place.cell[1], cells)));
    InnerPixels::Block& block = pixels.block[static_cast<std::size_t>(pixels.count / kLanes)];
    const int lane = pixels.count % kLanes;
    if (lane == 0) block.weight.setZero();
    if (!put(pattern, place, cells, lane, block)) return;
    const double light = 1.0 + estimate.light_per_px.dot(px - middle);
    block.value[lane] = static_cast<float>(image.row(y)[x] / light);
    block.weight[lane] = 1;
    ++pixels.count;
  });
  if (pixels.count % kLanes == 0) return;  // the last block is full, or there is none
  InnerPixels::Block& last = pixels.block[pixels.blocks() - 1];
  for (int lane = pixels.count % kLanes; lane < kLanes; ++lane) {
    const auto repeat = [lane](Lanes& lanes) { lanes[lane] = lanes[0]; };  // of weight 0, but finite
    for (Lanes* lanes : {&last.value, &last.s, &last.t}) repeat(*lanes);
    std::ranges::for_each(last.px_per_cell, repeat);
    for (auto& axis : last.past_px) std::ranges::for_each(axis, repeat);
    for (auto& axis : last.place) std::ranges::for_each(axis, repeat);
    for (auto& row : last.white) std::ranges::for_each(row, repeat);
    last.weight[lane] = 0;
  }
}

}  // namespace waymark::refinement
