#include "waymark/tags/refinement/edge_model.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace waymark::refinement {
namespace {

/// Row and position of the cell (x, y) relative to edge `k`. Rows are counted inwards from the edge: the ring
/// inside the border is row 0, and the bits behind it are row 1. Outwards, the ring is row -1, and the row
/// beyond it is row -2.
std::pair<int, int> row_and_place(int k, int cells, const BitCell& cell) {
  switch (k) {
    case 0:
      return {cell.y, cell.x};
    case 1:
      return {cells - 1 - cell.x, cell.y};
    case 2:
      return {cells - 1 - cell.y, cells - 1 - cell.x};
    default:
      return {cell.x, cells - 1 - cell.y};
  }
}

}  // namespace

std::array<Surroundings, 4> tag_surroundings(const TagId& id) {
  const Family& table = family(id.family);
  const int cells = table.width_at_border;
  assert(cells <= kMaxCells && id.number >= 0 && static_cast<std::size_t>(id.number) < table.codes.size());
  const std::uint64_t code = table.codes[static_cast<std::size_t>(id.number)];
  std::array<Surroundings, 4> edges;
  std::array<int, 4> known_beyond{};
  for (Surroundings& edge : edges) edge.cells = cells;
  for (std::size_t bit = 0; bit < table.bits.size(); ++bit) {
    const bool white = ((code >> (table.bits.size() - 1 - bit)) & 1U) != 0;
    const float share = white != table.reversed_border ? 1.0F : 0.0F;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto [row, place] = row_and_place(static_cast<int>(k), cells, table.bits[bit]);
      if (place < 0 || place >= cells) continue;
      if (row == 1) edges[k].behind[static_cast<std::size_t>(place)] = share;
      if (row == -2) {
        edges[k].beyond[static_cast<std::size_t>(place)] = share;
        ++known_beyond[k];
      }
    }
  }
  for (std::size_t k = 0; k < 4; ++k) edges[k].beyond_known = known_beyond[k] == cells;
  return edges;
}

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector2d outward_normal(const Vector2d& from, const Vector2d& to) {
  const Vector2d along = (to - from).normalized();
  return {along.y(), -along.x()};
}

/// The line v = cells as a unit line whose signed distance increases outwards (towards smaller v).
Vector3d line_at(const Eigen::Matrix3d& cell_H_px, double cells, const Vector2d& outward) {
  Vector3d line = (cell_H_px.row(1) - cells * cell_H_px.row(2)).transpose();
  line /= line.head<2>().norm();
  return line.head<2>().dot(outward) < 0 ? Vector3d(-line) : line;
}

double distance(const Vector3d& line, const Vector2d& p) {
  return std::abs(line.dot(Vector3d(p.x(), p.y(), 1.0)));
}

/// Pixels next to the band can be close to the horizon of the tag's plane. They have no weight, but must stay
/// finite.
constexpr float kMinW = 0.05F;

/// Geometry of the slices of a band. Slices are lined up along the major axis, and each runs along the minor
/// axis. Positions are relative to the middle of the edge to preserve float precision.
struct Slicing {
  int major = 0;
  int minor = 1;
  int first = 0;  ///< pixel index of slice 0 along the major axis
  int stride = 1;
  int major_size = 0;  ///< size of the image along the major axis [px]
  int minor_size = 0;
  int outward = 1;    ///< sign of a step outwards along the minor axis
  double cosine = 1;  ///< change in distance per pixel along the minor axis
  double slope = 0;   ///< slope of the edge: minor per major
  double half = 1;    ///< half the length of the edge along the major axis, signed
  Vector2d middle{0, 0};
};

Slicing slice(const ImageView& image, const EdgeFrame& edge, const BandLimits& limits, Band& band) {
  Slicing s;
  const Vector2d span = edge.to - edge.from;
  s.major = std::abs(span.x()) >= std::abs(span.y()) ? 0 : 1;
  s.minor = 1 - s.major;
  s.major_size = s.major == 0 ? image.width : image.height;
  s.minor_size = s.major == 0 ? image.height : image.width;
  s.outward = edge.normal[s.minor] > 0 ? 1 : -1;
  s.cosine = std::abs(edge.normal[s.minor]);
  s.slope = span[s.minor] / span[s.major];
  s.half = 0.5 * span[s.major];
  s.middle = 0.5 * (edge.from + edge.to);
  const double trim = limits.corner_margin_px * s.cosine;
  const double low = s.middle[s.major] - std::abs(s.half) + trim;
  const double high = s.middle[s.major] + std::abs(s.half) - trim;
  s.first = std::max(0, static_cast<int>(std::ceil(low - 0.5)));
  const int last = std::min(s.major_size - 1, static_cast<int>(std::floor(high - 0.5)));
  const int count = std::max(0, last - s.first + 1);
  s.stride = std::max(1, (count + limits.max_slices - 1) / limits.max_slices);
  band.slices = (count + s.stride - 1) / s.stride;
  band.blocks = (band.slices + kLanes - 1) / kLanes;
  band.step_px = static_cast<float>(s.cosine);
  band.depth =
      std::min(kMaxDepth, static_cast<int>(std::ceil((limits.inside_px + limits.outside_px) / s.cosine)) + 1);
  return s;
}

/// A linear function of the pixel position, evaluated per lane.
struct LinearLanes {
  float major = 0, minor = 0, constant = 0;
  LinearLanes(const Vector3d& line, const Slicing& s)
      : major(static_cast<float>(line[s.major])),
        minor(static_cast<float>(line[s.minor])),
        constant(static_cast<float>(line.head<2>().dot(s.middle) + line.z())) {}
  [[nodiscard]] Lanes at(const Lanes& major_px, const Lanes& minor_px) const {
    return constant + major * major_px + minor * minor_px;
  }
};

Vector3d line_through(const Vector2d& p, const Vector2d& normal) {
  return {normal.x(), normal.y(), -normal.dot(p)};
}

/// Level of the row at `u` cells along the edge, blurred by `sigma` cells.
Lanes blurred_row(const CellRow& row, int cells, const Lanes& u, const Lanes& inverse_sigma) {
  Lanes share = Lanes::Constant(row[0]);
  for (int j = 1; j < cells; ++j) {
    const float jump = row[static_cast<std::size_t>(j)] - row[static_cast<std::size_t>(j) - 1];
    if (jump != 0.0F) share += jump * bell_cdf<Lanes>((u - static_cast<float>(j)) * inverse_sigma);
  }
  return share;
}

/// Avoids std::floor(), which is a function call on processors without an instruction for it.
int floor_to_int(double x) {
  const int towards_zero = static_cast<int>(x);
  return towards_zero - (x < towards_zero ? 1 : 0);
}

/// The first pixel of each slice in a block.
struct BlockStart {
  std::array<int, kLanes> major_index{};
  std::array<int, kLanes> minor_index{};
  Lanes major_px;  ///< position relative to the middle of the edge
  Lanes minor_px;
  Lanes live;  ///< 1 for lanes that contain a slice
};

BlockStart start_block(const EdgeFrame& edge, const Slicing& s, const BandLimits& limits, int block,
                       Band& band) {
  BlockStart start;
  const auto b = static_cast<std::size_t>(block);
  for (int lane = 0; lane < kLanes; ++lane) {
    const int index = block * kLanes + lane;
    const int i = s.first + std::min(index, band.slices - 1) * s.stride;
    const double major_px = i + 0.5 - s.middle[s.major];
    const double place = major_px / s.half;
    const double edge_px =
        s.middle[s.minor] + s.slope * major_px + s.outward * edge.bulge_at(place) / s.cosine;
    const double from = edge_px - s.outward * limits.inside_px / s.cosine - 0.5;
    const int j = s.outward > 0 ? -floor_to_int(-from) : floor_to_int(from);
    start.major_index[static_cast<std::size_t>(lane)] = i;
    start.minor_index[static_cast<std::size_t>(lane)] = j;
    start.major_px[lane] = static_cast<float>(major_px);
    start.minor_px[lane] = static_cast<float>(j + 0.5 - s.middle[s.minor]);
    start.live[lane] = index < band.slices ? 1.0F : 0.0F;
    band.along[b][lane] = static_cast<float>(place);
    band.first_px[b][lane] = static_cast<float>((j + 0.5 - edge_px) * s.outward * s.cosine);
  }
  return start;
}

/// Whether all pixels in the slices of a block are within the image.
bool within_image(const Slicing& s, const BlockStart& start, int depth) {
  const auto [least, most] = std::ranges::minmax(start.minor_index);
  const int reach = (depth - 1) * s.outward;
  return least + std::min(reach, 0) >= 0 && most + std::max(reach, 0) < s.minor_size;
}

/// Grey levels of the `d`-th pixels in the slices of a block. Pixels outside the image get weight 0.
void read_pixels(const ImageView& image, const Slicing& s, const BlockStart& start, bool all_there, int d,
                 Lanes& value, Lanes& weight) {
  const std::ptrdiff_t major_step = s.major == 0 ? 1 : image.stride;
  const std::ptrdiff_t minor_step = s.major == 0 ? image.stride : 1;
  Eigen::Array<int, kLanes, 1> level;  // all converted together at the end
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const int j = start.minor_index[lane] + d * s.outward;
    const bool there = all_there || (j >= 0 && j < s.minor_size);
    const std::ptrdiff_t at = there ? start.major_index[lane] * major_step + j * minor_step : 0;
    level[static_cast<Eigen::Index>(lane)] = image.data[at];
    if (!there) weight[static_cast<Eigen::Index>(lane)] = 0.0F;
  }
  value = level.cast<float>();
}

}  // namespace

bool is_convex(const Quad& corners_px) {
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d u = corners_px[(k + 1) % 4] - corners_px[k];
    const Vector2d v = corners_px[(k + 2) % 4] - corners_px[k];
    if (!(u.x() * v.y() - u.y() * v.x() > 1.0)) return false;
  }
  return true;
}

double farthest_px(const Quad& a, const Quad& b) {
  double farthest = 0;
  for (std::size_t k = 0; k < 4; ++k) farthest = std::max(farthest, (a[k] - b[k]).norm());
  return farthest;
}

Eigen::Matrix3d homography_of_unit_square(const Quad& quad) {
  const auto& [a, b, c, d] = quad;
  const Vector2d u = b - c;
  const Vector2d v = d - c;
  const Vector2d s = a - b + c - d;
  const double det = u.x() * v.y() - u.y() * v.x();
  const double g = (s.x() * v.y() - s.y() * v.x()) / det;
  const double h = (u.x() * s.y() - u.y() * s.x()) / det;
  Eigen::Matrix3d H;
  H << b.x() - a.x() + g * b.x(), d.x() - a.x() + h * d.x(), a.x(),  //
      b.y() - a.y() + g * b.y(), d.y() - a.y() + h * d.y(), a.y(),   //
      g, h, 1.0;
  return H;
}

PrintedTag printed_tag(const ImageView& image, const TagId& id, const Quad& corners_px) {
  constexpr double kSaturatedShare = 0.8;
  const Family& table = family(id.family);
  const std::uint64_t code = table.codes[static_cast<std::size_t>(id.number)];
  const Eigen::Matrix3d px_H_unit = homography_of_unit_square(corners_px);
  std::array<double, 2> sum{};
  std::array<int, 2> count{};
  std::array<int, 2> saturated{};
  for (std::size_t bit = 0; bit < table.bits.size(); ++bit) {
    const Eigen::Vector3d unit((table.bits[bit].x + 0.5) / table.width_at_border,
                               (table.bits[bit].y + 0.5) / table.width_at_border, 1);
    const Vector2d px = (px_H_unit * unit).hnormalized();
    if (!px.allFinite()) continue;
    const std::size_t white = (code >> (table.bits.size() - 1 - bit)) & 1U;
    const double level = sample_bilinear(image, px.x(), px.y());
    sum[white] += level;
    ++count[white];
    saturated[white] += level >= kBrightest ? 1 : 0;
  }
  const bool known = count[0] > 0 && count[1] > 0;
  const bool inverted = known && sum[1] / count[1] < sum[0] / count[0];
  const std::size_t brighter = inverted ? 0 : 1;
  return {id, inverted, known && saturated[brighter] >= kSaturatedShare * count[brighter]};
}

std::array<EdgeFrame, 4> edge_frames(const Quad& corners_px, int cells) {
  std::array<EdgeFrame, 4> edges;
  for (std::size_t k = 0; k < 4; ++k) {
    EdgeFrame& edge = edges[k];
    const Vector2d& a = corners_px[k];
    const Vector2d& b = corners_px[(k + 1) % 4];
    const Vector2d& c = corners_px[(k + 2) % 4];
    const Vector2d& d = corners_px[(k + 3) % 4];
    edge.from = a;
    edge.to = b;
    edge.normal = outward_normal(a, b);
    edge.normal_before = outward_normal(d, a);
    edge.normal_after = outward_normal(b, c);
    edge.length_px = (b - a).norm();
    edge.cell_H_px = homography_of_unit_square({a, b, c, d}).inverse();
    edge.cell_H_px.topRows<2>() *= cells;
    const Vector2d middle = 0.5 * (a + b);
    edge.cell_H_px /= edge.cell_H_px.row(2).dot(Vector3d(middle.x(), middle.y(), 1.0));  // so w = 1 there
    edge.behind_line = line_at(edge.cell_H_px, 1.0, edge.normal);
    edge.beyond_line = line_at(edge.cell_H_px, -1.0, edge.normal);
    edge.cell_px = std::min({distance(edge.behind_line, a), distance(edge.behind_line, b),
                             distance(edge.beyond_line, a), distance(edge.beyond_line, b)});
  }
  return edges;
}

void read_band(const ImageView& image, const EdgeFrame& edge, const Surroundings& near,
               const BandLimits& limits, double blur_px, Band& band) {
  const Slicing s = slice(image, edge, limits, band);
  const LinearLanes before(line_through(edge.from, edge.normal_before), s);
  const LinearLanes after(line_through(edge.to, edge.normal_after), s);
  const LinearLanes behind(edge.behind_line, s);
  const LinearLanes beyond(edge.beyond_line, s);
  const LinearLanes u0(edge.cell_H_px.row(0), s);
  const LinearLanes u2(edge.cell_H_px.row(2), s);
  const auto margin = static_cast<float>(limits.corner_margin_px);
  const auto outside = static_cast<float>(limits.outside_px);
  const auto inverse_blur = static_cast<float>(1.0 / blur_px);
  band.cells_matter = limits.cells_matter;
  band.beyond_known = near.beyond_known;
  Lanes pixels = Lanes::Zero();
  Lanes darkest = Lanes::Constant(255.0F);
  Lanes brightest = Lanes::Zero();
  for (int block = 0; block < band.blocks; ++block) {
    const auto b = static_cast<std::size_t>(block);
    const BlockStart start = start_block(edge, s, limits, block, band);
    const bool all_there = within_image(s, start, band.depth);
    if (limits.cells_matter) {
      const Lanes edge_minor = static_cast<float>(s.slope) * start.major_px;
      band.behind_px[b] = behind.at(start.major_px, edge_minor).abs();
      band.beyond_px[b] = beyond.at(start.major_px, edge_minor).abs();
    }
    for (int d = 0; d < band.depth; ++d) {
      const auto j = static_cast<std::size_t>(d);
      const Lanes minor_px = start.minor_px + static_cast<float>(d * s.outward);
      const Lanes from_before = before.at(start.major_px, minor_px);
      const Lanes from_after = after.at(start.major_px, minor_px);
      const Lanes distance_px = band.first_px[b] + static_cast<float>(d) * band.step_px;
      Lanes& weight = band.weight[b][j];
      weight = start.live *
               positive<Lanes>((-margin - from_before).min(-margin - from_after).min(outside - distance_px));
      read_pixels(image, s, start, all_there, d, band.value[b][j], weight);
      pixels += weight;
      darkest = darkest.min(255.0F + weight * (band.value[b][j] - 255.0F));
      brightest = brightest.max(weight * band.value[b][j]);
      if (!limits.cells_matter) continue;
      const Lanes inverse_w = u2.at(start.major_px, minor_px).max(kMinW).inverse();
      const Lanes u = u0.at(start.major_px, minor_px) * inverse_w;
      const Lanes du_major = (u0.major - u * u2.major) * inverse_w;
      const Lanes du_minor = (u0.minor - u * u2.minor) * inverse_w;
      const Lanes inverse_sigma = inverse_blur * (du_major.square() + du_minor.square()).rsqrt();
      band.behind[b][j] = blurred_row(near.behind, near.cells, u, inverse_sigma);
      band.beyond[b][j] = near.beyond_known
                              ? Lanes(blurred_row(near.beyond, near.cells, u, inverse_sigma) - 1.0F)
                              : Lanes(Lanes::Zero());
      band.inside[b][j] =
          bell_cdf<Lanes>(-from_before * inverse_blur) * bell_cdf<Lanes>(-from_after * inverse_blur);
    }
  }
  band.pixels = static_cast<int>(std::lround(pixels.sum()));
  band.clipped = darkest.minCoeff() <= kDarkest || brightest.maxCoeff() >= kBrightest;
}

namespace {

EdgePoint edge_point(const EdgeVector& x, double illumination) {
  const auto inverse_blur = static_cast<float>(std::exp(-x[kLogBlur]));
  const auto step = static_cast<float>(x[kStep]);
  return {.from = static_cast<float>(x[kFrom]),
          .to = static_cast<float>(x[kTo]),
          .bend = static_cast<float>(x[kBend]),
          .beyond = static_cast<float>(x[kBeyond]),
          .inner = static_cast<float>(x[kInnerLevel]),
          .step = step,
          .inverse_blur = inverse_blur,
          .illumination = static_cast<float>(illumination),
          // A pixel is considered flat if its slope is at most that of a blurred edge at a distance of two
          // standard deviations.
          .flat_shift = 0.054F * std::abs(step) * inverse_blur};
}

BandRows band_rows(const Band& band) {
  return {.blocks = band.blocks,
          .depth = band.depth,
          .max_depth = kMaxDepth,
          .step_px = band.step_px,
          .cells_matter = band.cells_matter,
          .beyond_known = band.beyond_known,
          .clipped = band.clipped,
          .along = band.along[0].data(),
          .first_px = band.first_px[0].data(),
          .behind_px = band.behind_px[0].data(),
          .beyond_px = band.beyond_px[0].data(),
          .value = band.value[0][0].data(),
          .weight = band.weight[0][0].data(),
          .behind = band.behind[0][0].data(),
          .beyond = band.beyond[0][0].data(),
          .inside = band.inside[0][0].data()};
}

}  // namespace

EdgeSums sum_edge_portable(const BandRows& band, const EdgePoint& x, float* costs) {
  return sums::sum_edge<Lanes>(band, x, costs);
}

SumEdge fastest_sum_edge() {
#ifdef WAYMARK_AVX2
  static const bool kHasAvx2 = __builtin_cpu_supports("avx2") > 0 && __builtin_cpu_supports("fma") > 0;
  if (kHasAvx2) return sum_edge_avx2;
#endif
  return sum_edge_portable;
}

NormalEquations linearize(const Band& band, const EdgeVector& parameters, double illumination,
                          SliceCosts& costs, SumEdge sum_edge) {
  const EdgeSums sums = sum_edge(band_rows(band), edge_point(parameters, illumination), costs[0].data());
  NormalEquations normal;
  for (int i = 0; i < kParameters; ++i) {
    for (int k = i; k < kParameters; ++k) {
      normal.information(i, k) = static_cast<double>(sums.information[i][k]);
      normal.information(k, i) = normal.information(i, k);
    }
    normal.gradient[i] = static_cast<double>(sums.gradient[i]);
  }
  normal.cost = static_cast<double>(sums.cost);
  normal.flat_cost = static_cast<double>(sums.flat_cost);
  normal.flat_pixels = static_cast<double>(sums.flat_pixels);
  normal.illumination_information = static_cast<double>(sums.illumination_information);
  normal.illumination_gradient = static_cast<double>(sums.illumination_gradient);
  return normal;
}

}  // namespace waymark::refinement
