#include "waymark/tags/refinement/bent_sheet.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "waymark/families/family.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement/cell_colors.hpp"

namespace waymark::refinement {
namespace {

using Eigen::Vector2d;

constexpr double kMinCellPx = 3.5;    ///< blur moves the steps of smaller cells
constexpr double kBeyondCells = 0.3;  ///< the offset of steps that are not where they are expected

constexpr std::size_t kInside = 4;

/// A step between two cells: its expected place and its offset from it.
struct SheetStep {
  int axis = 0;
  std::size_t side = kInside;  ///< of the border, if it is a step from the border to its surroundings
  double u = 0, v = 0;         ///< [cell]
  bool rises = false;
  bool visible = false;
  double offset = 0;  ///< [cell] along the axis
};

struct SheetSteps {
  std::array<SheetStep, 2 * static_cast<std::size_t>(kMaxCells) * (kMaxCells + 1)> all{};
  std::size_t count = 0;
  int cells = 0;

  [[nodiscard]] double s(const SheetStep& step) const { return 2 * step.u / cells - 1; }
  [[nodiscard]] double t(const SheetStep& step) const { return 2 * step.v / cells - 1; }
};

void list_steps(const PrintedTag& print, SheetSteps& steps) {
  const CellColors colors(print);
  const int w = colors.width();
  steps.cells = w;
  const auto add = [&](int axis, int line, double along, int change) {
    if (change == 0 || steps.count == steps.all.size()) return;
    SheetStep& step = steps.all[steps.count++];
    step = {.axis = axis, .u = axis == 0 ? line : along, .v = axis == 0 ? along : line, .rises = change > 0};
    if (line == 0) step.side = axis == 0 ? 3 : 0;
    if (line == w) step.side = axis == 0 ? 1 : 2;
  };
  for (int line = 0; line <= w; ++line) {
    for (int k = 0; k < w; ++k) {
      add(0, line, k + 0.5, colors.change(line - 1, k, line, k));
      add(1, line, k + 0.5, colors.change(k, line - 1, k, line));
    }
  }
}

/// A plane through four corners.
class FlatSheet {
 public:
  FlatSheet(const Quad& corners_px, int cells)
      : cells_(cells), px_H_unit_(homography_of_unit_square(corners_px)) {}
  [[nodiscard]] Vector2d px(double u, double v) const {
    return (px_H_unit_ * Eigen::Vector3d(u / cells_, v / cells_, 1)).hnormalized();
  }

 private:
  double cells_;
  Eigen::Matrix3d px_H_unit_;
};

using Stretch = Eigen::Matrix<double, 6, 1>;

/// Derivatives of the place along an axis with respect to the stretch of the bent sheet [cell].
Stretch stretch_row(int axis, double s, double t) {
  Stretch row = Stretch::Zero();
  const double at = axis == 0 ? s : t;
  row.segment<3>(Eigen::Index{3} * axis) = (1 - at * at) * Eigen::Vector3d(1, s, t);
  return row;
}

/// A sheet that is bent as its border is (a Coons patch). A bent sheet also moves the cells along its sides,
/// and its middle: it is stretched between its sides.
class BentSheet {
 public:
  BentSheet(const CurvedBorder& border, int cells)
      : cells_(cells), plane_(border.corners_px, cells), edges_(edge_frames(border.corners_px, cells)) {
    for (std::size_t k = 0; k < 4; ++k) edges_[k].bulge_px = border.bulge_px[k];
  }

  [[nodiscard]] Vector2d px(double u, double v) const {
    const double s = 2 * u / cells_ - 1;
    const double t = 2 * v / cells_ - 1;
    const double at_u = u + stretch_row(0, s, t).dot(stretch);
    const double at_v = v + stretch_row(1, s, t).dot(stretch);
    return plane_.px(at_u, at_v) + bend(at_u, at_v);
  }

  Stretch stretch = Stretch::Zero();

 private:
  /// How far the bends of the border move a place [px].
  [[nodiscard]] Vector2d bend(double u, double v) const {
    const auto of = [&](std::size_t k, double at_u, double at_v) -> Vector2d {
      const EdgeFrame& edge = edges_[k];
      const Vector2d chord = edge.to - edge.from;
      const double along = 2 * chord.dot(plane_.px(at_u, at_v) - edge.from) / chord.squaredNorm() - 1;
      return edge.bulge_at(along) * edge.normal;
    };
    const double s = u / cells_;
    const double t = v / cells_;
    return (1 - t) * of(0, u, 0) + t * of(2, u, cells_) + s * of(1, cells_, v) + (1 - s) * of(3, 0, v);
  }

  double cells_;
  FlatSheet plane_;
  std::array<EdgeFrame, 4> edges_;
};

/// Measures a step where the sheet places it: the mean of the places, weighted by the squared rises.
template <class Sheet>
void measure_step(const ImageView& image, const Sheet& sheet, SheetStep& step) {
  constexpr int kSamples = 10;
  constexpr double kReach = 0.44;  // cells to either side
  constexpr double kApart = 2 * kReach / (kSamples - 1);
  constexpr double kLeastWeight = 25;
  const double du = step.axis == 0 ? kReach : 0;
  const double dv = step.axis == 0 ? 0 : kReach;
  const Vector2d from = sheet.px(step.u - du, step.v - dv);
  const Vector2d apart = (sheet.px(step.u + du, step.v + dv) - from) / (kSamples - 1);
  double before = 0;
  double weight = 0;
  double moment = 0;
  for (int k = 0; k < kSamples; ++k) {
    const Vector2d px = from + k * apart;
    const double level = (step.rises ? 1 : -1) * sample_bilinear(image, px.x(), px.y());
    const double rise = k == 0 ? 0 : std::max(0.0, level - before);
    before = level;
    weight += rise * rise;
    moment += rise * rise * (k - 0.5);
  }
  step.visible = weight >= kLeastWeight;
  step.offset = step.visible ? moment / weight * kApart - kReach : kBeyondCells;
}

template <class Sheet>
void measure_steps(const ImageView& image, const Sheet& sheet, SheetSteps& steps) {
  for (std::size_t i = 0; i < steps.count; ++i) measure_step(image, sheet, steps.all[i]);
}

/// The unknowns that explain the offsets inside the border, by least squares with Tukey weights. `base` are
/// the current unknowns to which the offsets refer, and about 0 they have standard deviations `sigma` [cell].
template <int Unknowns, class Row>
Eigen::Matrix<double, Unknowns, 1> explain(const SheetSteps& steps,
                                           const Eigen::Matrix<double, Unknowns, 1>& sigma,
                                           const Eigen::Matrix<double, Unknowns, 1>& base, double beyond,
                                           const Row& row) {
  constexpr double kStepCells = 0.05;
  constexpr int kIterations = 3;
  using Vector = Eigen::Matrix<double, Unknowns, 1>;
  Vector x = base;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::Matrix<double, Unknowns, Unknowns> information =
        (kStepCells / sigma.array()).square().matrix().asDiagonal();
    Vector gradient = Vector::Zero();
    for (std::size_t i = 0; i < steps.count; ++i) {
      const SheetStep& step = steps.all[i];
      if (!step.visible || step.side != kInside) continue;
      const Vector r = row(step.axis, steps.s(step), steps.t(step));
      const double far = std::abs(step.offset - r.dot(x - base)) / beyond;
      const double weight = far < 1 ? (1 - far * far) * (1 - far * far) : 0;
      information += weight * r * r.transpose();
      gradient += weight * (step.offset + r.dot(base)) * r;
    }
    x = information.ldlt().solve(gradient);
  }
  return x;
}

using PlaneShift = Eigen::Matrix<double, 8, 1>;

/// Derivatives of the place along an axis with respect to a small homography.
PlaneShift plane_row(int axis, double s, double t) {
  PlaneShift row = PlaneShift::Zero();
  const double at = axis == 0 ? s : t;
  row.segment<3>(Eigen::Index{3} * axis) << 1, s, t;
  row.tail<2>() << at * s, at * t;
  return row;
}

bool move_plane(const PlaneShift& x, int cells, Quad& corners) {
  constexpr std::array<std::array<int, 2>, 4> kUnit = {{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  const FlatSheet plane(corners, cells);
  for (std::size_t k = 0; k < 4; ++k) {
    const auto [s, t] = kUnit[k];
    corners[k] = plane.px(0.5 * cells * (1 + s) + plane_row(0, s, t).dot(x),
                          0.5 * cells * (1 + t) + plane_row(1, s, t).dot(x));
    if (!corners[k].allFinite()) return false;
  }
  return true;
}

/// Mean squared offsets: of the steps inside, of those in each quarter of the tag, and of the sides of the
/// border.
struct MeanSquares {
  double inside = kBeyondCells * kBeyondCells;
  std::array<double, 4> quarter{};
  std::array<double, 4> side{};
};

MeanSquares mean_squares(const SheetSteps& steps) {
  MeanSquares sums{.inside = 0};
  std::array<int, 4> in_quarter{};
  std::array<int, 4> on_side{};
  for (std::size_t i = 0; i < steps.count; ++i) {
    const SheetStep& step = steps.all[i];
    const double square = std::pow(std::min(std::abs(step.offset), kBeyondCells), 2);
    if (step.side != kInside) {
      sums.side.at(step.side) += square;
      ++on_side.at(step.side);
      continue;
    }
    const std::size_t quarter = (steps.s(step) < 0 ? 0U : 1U) + (steps.t(step) < 0 ? 0U : 2U);
    sums.inside += square;
    sums.quarter.at(quarter) += square;
    ++in_quarter.at(quarter);
  }
  sums.inside /= std::max(1, in_quarter[0] + in_quarter[1] + in_quarter[2] + in_quarter[3]);
  for (std::size_t k = 0; k < 4; ++k) {
    sums.quarter.at(k) /= std::max(1, in_quarter.at(k));
    sums.side.at(k) /= std::max(1, on_side.at(k));
  }
  return sums;
}

/// By how much white cells have grown into black ones, with its standard deviation [cell].
struct Growth {
  double cells = 0;
  double sigma = 0;
};

Growth white_growth(const SheetSteps& steps) {
  constexpr int kIterations = 3;
  constexpr int kMinSteps = 12;
  Growth growth;
  double beyond = kBeyondCells;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    double sum = 0;
    double squares = 0;
    int count = 0;
    for (std::size_t i = 0; i < steps.count; ++i) {
      const SheetStep& step = steps.all[i];
      if (!step.visible || step.side != kInside) continue;
      const double here = step.rises ? -step.offset : step.offset;
      if (std::abs(here - growth.cells) > beyond) continue;
      sum += here;
      squares += here * here;
      ++count;
    }
    if (count < kMinSteps) return {};
    growth.cells = sum / count;
    const double variance = std::max(0.0, squares / count - growth.cells * growth.cells);
    growth.sigma = std::sqrt(variance / count);
    beyond = std::min(beyond, 3 * std::sqrt(variance) + 0.02);
  }
  return growth;
}

void remove_growth(const Growth& growth, SheetSteps& steps) {
  for (std::size_t i = 0; i < steps.count; ++i) {
    SheetStep& step = steps.all[i];
    if (step.visible) step.offset += step.rises ? growth.cells : -growth.cells;
  }
}

/// Fits a flat sheet, from the given corners.
MeanSquares fit_flat(const ImageView& image, Quad corners_px, SheetSteps& steps) {
  constexpr std::array<double, 6> kBeyond = {0.6, 0.6, 0.4, 0.3, 0.3, 0.3};  // cells
  for (const double beyond : kBeyond) {
    measure_steps(image, FlatSheet(corners_px, steps.cells), steps);
    const PlaneShift moved =
        explain<8>(steps, PlaneShift::Constant(1.0), PlaneShift::Zero(), beyond, plane_row);
    if (!moved.allFinite() || !move_plane(moved, steps.cells, corners_px)) return {};
  }
  measure_steps(image, FlatSheet(corners_px, steps.cells), steps);
  remove_growth(white_growth(steps), steps);
  return mean_squares(steps);
}

/// Fits the stretch of a bent sheet.
MeanSquares fit_bent(const ImageView& image, BentSheet sheet, SheetSteps& steps, Growth& growth) {
  constexpr std::array<double, 3> kBeyond = {0.6, 0.3, 0.3};  // cells
  Stretch sigma;
  sigma << 0.4, 0.15, 0.15, 0.4, 0.15, 0.15;  // cells
  for (const double beyond : kBeyond) {
    measure_steps(image, sheet, steps);
    sheet.stretch = explain<6>(steps, sigma, sheet.stretch, beyond, stretch_row);
    if (!sheet.stretch.allFinite()) return {};
  }
  measure_steps(image, sheet, steps);
  growth = white_growth(steps);
  remove_growth(growth, steps);
  return mean_squares(steps);
}

/// The share of the steps in the two outer rows of bits along each side that are in place.
std::array<double, 4> share_in_place(const SheetSteps& steps) {
  constexpr double kInPlaceCells = 0.15;
  constexpr double kRows = 3.1;  // the border and two rows of bits [cell]
  std::array<double, 4> near{};
  std::array<double, 4> all{};
  for (std::size_t i = 0; i < steps.count; ++i) {
    const SheetStep& step = steps.all[i];
    if (step.side != kInside) continue;
    const std::array<double, 4> from_side = {step.v, steps.cells - step.u, steps.cells - step.v, step.u};
    for (std::size_t k = 0; k < 4; ++k) {
      if (from_side.at(k) > kRows) continue;
      all.at(k) += 1;
      near.at(k) += std::abs(step.offset) < kInPlaceCells ? 1 : 0;
    }
  }
  for (std::size_t k = 0; k < 4; ++k) near.at(k) /= std::max(1.0, all.at(k));
  return near;
}

}  // namespace

bool SheetComparison::confirms_bend() const {
  return bits_are_in_place() && (bits_prefer_bend() || border_excludes_plane());
}

bool SheetComparison::allows_bend(const CurvedBorder& border) const {
  constexpr double kCurved = 1.5;
  constexpr double kStraight = 0.9;
  constexpr double kNoise = 1e-5;  // cells^2
  return bits_are_in_place() && if_bent < (is_curved(border) ? kCurved : kStraight) * if_flat + kNoise;
}

bool SheetComparison::bits_are_in_place() const {
  constexpr int kMinSteps = 12;
  constexpr double kMinInPlace = 0.9;
  return steps >= kMinSteps && cell_px >= kMinCellPx &&
         *std::min_element(in_place.begin(), in_place.end()) >= kMinInPlace;
}

/// The bits agree clearly better with the bent sheet, and in no quarter clearly worse.
bool SheetComparison::bits_prefer_bend() const {
  constexpr double kBetter = 0.57;
  constexpr double kNotWorse = 1.2;
  constexpr double kNoise = 0.001;  // cells^2
  if (!(if_bent < kBetter * if_flat)) return false;
  for (std::size_t k = 0; k < 4; ++k)
    if (bent_by_quarter.at(k) > kNotWorse * flat_by_quarter.at(k) + kNoise) return false;
  return true;
}

/// The bits agree well with the bent sheet, and the plane through them misses three sides of the border.
bool SheetComparison::border_excludes_plane() const {
  constexpr double kGood = 0.0015;  // cells^2
  constexpr double kNotWorse = 1.5;
  constexpr double kMissesCells = 0.07;
  constexpr double kMissesPx = 0.5;
  return if_bent < std::min(kGood, kNotWorse * if_flat) &&
         std::sqrt(border_if_flat) > std::max(kMissesCells, kMissesPx / cell_px);
}

SheetComparison compare_sheets(const ImageView& image, const PrintedTag& print, const CurvedBorder& border,
                               const Quad& near_px) {
  constexpr double kSameStartCells = 0.15;  // a fit from there would end at the same plane
  SheetSteps steps;
  list_steps(print, steps);
  SheetComparison result;
  for (std::size_t i = 0; i < steps.count; ++i) result.steps += steps.all[i].side == kInside ? 1 : 0;
  MeanSquares flat = fit_flat(image, border.corners_px, steps);
  if (farthest_px(border.corners_px, near_px) > kSameStartCells * mean_side_px(near_px) / steps.cells) {
    const MeanSquares other = fit_flat(image, near_px, steps);
    if (other.inside < flat.inside) flat = other;
  }
  result.if_flat = flat.inside;
  std::sort(flat.side.begin(), flat.side.end());
  result.border_if_flat = flat.side[1];
  result.cell_px = mean_side_px(border.corners_px) / steps.cells;
  result.flat_by_quarter = flat.quarter;
  Growth growth;
  const MeanSquares bent = fit_bent(image, BentSheet(border, steps.cells), steps, growth);
  result.white_growth_px = growth.cells * result.cell_px;
  result.white_growth_sigma_px = growth.sigma * result.cell_px;
  result.if_bent = bent.inside;
  result.bent_by_quarter = bent.quarter;
  result.in_place = share_in_place(steps);
  return result;
}

std::optional<Bend> find_bend(const ImageView& image, const PrintedTag& print, const Quad& near_px,
                              double least_bulge_px) {
  if (mean_side_px(near_px) < kMinCellPx * family(print.id.family).width_at_border) return std::nullopt;
  auto border = follow_border(image, print, near_px, least_bulge_px);
  if (!border || !is_convex(border->corners_px)) return std::nullopt;
  const SheetComparison sheets = compare_sheets(image, print, *border, near_px);
  const bool confirmed = sheets.confirms_bend();
  if (!confirmed && !sheets.allows_bend(*border)) return std::nullopt;
  move_outwards(print.outwards() * sheets.white_growth_px, sheets.white_growth_sigma_px, *border);
  return Bend{*border, confirmed, sheets.if_bent};
}

}  // namespace waymark::refinement
