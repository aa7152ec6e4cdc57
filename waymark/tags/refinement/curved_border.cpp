#include "waymark/tags/refinement/curved_border.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement/bit_cells.hpp"

namespace waymark::refinement {
namespace {

using Eigen::Vector2d;

constexpr int kCurve = 5;  ///< coefficients of a side: Legendre polynomials of order 0 to 4
using CurveVector = Eigen::Matrix<double, kCurve, 1>;
using CurveMatrix = Eigen::Matrix<double, kCurve, kCurve>;
constexpr std::size_t kMaxCrossings = 40;

CurveVector legendre(double t) {
  const double s = t * t;
  CurveVector p;
  p << 1, t, 0.5 * (3 * s - 1), 0.5 * t * (5 * s - 3), 0.125 * ((35 * s - 30) * s + 3);
  return p;
}

CurveVector legendre_slopes(double t) {
  const double s = t * t;
  CurveVector p;
  p << 0, 1, 3 * t, 0.5 * (15 * s - 3), 0.5 * t * (35 * s - 15);
  return p;
}

/// A place at which the border was found.
struct Crossing {
  double t = 0;       ///< along the chord, -1 to 1
  double out_px = 0;  ///< distance outwards from the chord
  double weight = 0;  ///< 0 if it is not on the curve
  double residual = 0;
};

/// One side, as a curve over a chord that does not change.
struct Side {
  Vector2d from{0, 0};
  Vector2d half{0, 0};  ///< half of the chord
  Vector2d normal{0, 0};
  double length_px = 0;
  double cell_px = 0;
  double begin = -1, end = 1;  ///< where the corners are
  CurveVector curve = CurveVector::Zero();
  CurveMatrix covariance = CurveMatrix::Zero();
  std::array<Crossing, kMaxCrossings> crossings{};
  std::size_t count = 0;
  std::size_t planned = 0;
  double rise = 0;  ///< [grey level] median step

  Side() = default;
  Side(const Vector2d& a, const Vector2d& b, int cells)
      : from(a), half(0.5 * (b - a)), length_px((b - a).norm()), cell_px(length_px / cells) {
    normal = Vector2d(half.y(), -half.x()).normalized();
  }

  [[nodiscard]] Vector2d at(double t) const {
    return from + (1 + t) * half + curve.dot(legendre(t)) * normal;
  }
  [[nodiscard]] Vector2d slope(double t) const { return half + curve.dot(legendre_slopes(t)) * normal; }
  [[nodiscard]] Vector2d normal_at(double t) const {
    const Vector2d along = slope(t);
    return Vector2d(along.y(), -along.x()).normalized();
  }
};

/// How the border is searched for near the current curve.
struct CurveSearch {
  double reach_px = 0;
  double step_px = 0.5;
  double margin_px = 0;  ///< distance kept from the corners
};

/// Finds the largest changes across the curve: the mean of the places, weighted by the squared rises.
void find_crossings(const ImageView& image, double outwards, const CurveSearch& search, Side& side) {
  constexpr double kMinRise = 25;    // [grey level^2], summed over a profile
  constexpr double kMinShare = 0.1;  // of the usual one
  const double span_px = 0.5 * (side.end - side.begin) * side.length_px;
  const double margin = std::min(search.margin_px, 0.2 * span_px) * 2 / side.length_px;
  const double first = side.begin + margin;
  const double last = side.end - margin;
  constexpr double kApartPx = 1.5;
  side.planned = std::clamp<std::size_t>(static_cast<std::size_t>(span_px / kApartPx), 8, kMaxCrossings);
  side.count = 0;
  const int samples = 1 + 2 * std::max(1, static_cast<int>(std::ceil(search.reach_px / search.step_px)));
  std::array<double, kMaxCrossings> rises{};
  for (std::size_t i = 0; i < side.planned; ++i) {
    const double t =
        first + (last - first) * (static_cast<double>(i) + 0.5) / static_cast<double>(side.planned);
    const double middle = side.curve.dot(legendre(t));
    const double begin = middle - 0.5 * (samples - 1) * search.step_px;
    const Vector2d chord = side.from + (1 + t) * side.half;
    double before = 0;
    double weight = 0;
    double moment = 0;
    double step = 0;
    for (int k = 0; k < samples; ++k) {
      const Vector2d px = chord + (begin + k * search.step_px) * side.normal;
      const double here = outwards * sample_bilinear(image, px.x(), px.y());
      const double rise = k == 0 ? 0 : std::max(0.0, here - before);
      before = here;
      step += rise;
      weight += rise * rise;
      moment += rise * rise * (k - 0.5);
    }
    if (weight < kMinRise) continue;
    rises.at(side.count) = step;
    side.crossings.at(side.count++) = {t, begin + moment / weight * search.step_px, 1, 0};
  }
  if (side.count == 0) return;
  std::array<double, kMaxCrossings> sorted = rises;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(side.count / 2);
  std::nth_element(sorted.begin(), middle, sorted.begin() + static_cast<std::ptrdiff_t>(side.count));
  for (std::size_t i = 0; i < side.count; ++i)
    if (rises.at(i) < kMinShare * *middle) side.crossings.at(i).weight = 0;
  side.rise = *middle;
}

double median_residual(const Side& side) {
  std::array<double, kMaxCrossings> sizes{};
  for (std::size_t i = 0; i < side.count; ++i) sizes.at(i) = std::abs(side.crossings.at(i).residual);
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(side.count / 2);
  std::nth_element(sizes.begin(), middle, sizes.begin() + static_cast<std::ptrdiff_t>(side.count));
  return *middle;
}

/// Variance of the crossings, times the number of neighbours that err together.
double correlated_variance(const Side& side, double weights) {
  constexpr double kFloorPx = 0.02;
  double squares = 0;
  double products = 0;
  for (std::size_t i = 0; i < side.count; ++i) {
    const Crossing& here = side.crossings.at(i);
    squares += here.weight * here.residual * here.residual;
    if (i > 0) {
      const Crossing& last = side.crossings.at(i - 1);
      products += std::sqrt(here.weight * last.weight) * here.residual * last.residual;
    }
  }
  const double together = std::clamp(products / std::max(squares, 1e-12), 0.0, 0.9);
  const double variance = squares / std::max(1.0, weights - kCurve) + kFloorPx * kFloorPx;
  return variance * (1 + together) / (1 - together);
}

/// Weighted least squares with Tukey weights, started with the weights of least absolute residuals. Returns
/// false if too few crossings are on one curve.
bool fit_curve(Side& side) {
  constexpr int kIterations = 8;
  constexpr double kLeastScalePx = 0.04;
  constexpr double kTukey = 4.7;
  constexpr double kMinShare = 0.65;
  // Bends of the sheet, as fractions of a cell; shifts and turns of a side are hardly limited.
  CurveVector bends;
  bends << 2, 2, 0.6, 0.25, 0.12;
  const CurveVector precision = (side.cell_px * bends).array().square().inverse();
  if (static_cast<double>(side.count) < kMinShare * static_cast<double>(side.planned)) return false;
  std::array<double, kMaxCrossings> visible{};
  for (std::size_t i = 0; i < side.count; ++i) visible.at(i) = side.crossings.at(i).weight;
  double variance = std::pow(0.1 * side.cell_px, 2);
  double weights = 0;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    CurveMatrix information = precision.asDiagonal();
    CurveVector gradient = CurveVector::Zero();
    for (std::size_t i = 0; i < side.count; ++i) {
      const Crossing& here = side.crossings.at(i);
      const CurveVector p = legendre(here.t);
      information += here.weight / variance * p * p.transpose();
      gradient += here.weight / variance * here.out_px * p;
    }
    side.covariance = information.inverse();
    side.curve = side.covariance * gradient;
    for (std::size_t i = 0; i < side.count; ++i) {
      Crossing& here = side.crossings.at(i);
      here.residual = here.out_px - side.curve.dot(legendre(here.t));
    }
    if (iteration + 1 == kIterations) break;
    const double scale = std::max(kLeastScalePx, 1.4826 * median_residual(side));
    weights = 0;
    for (std::size_t i = 0; i < side.count; ++i) {
      Crossing& here = side.crossings.at(i);
      const double far = std::abs(here.residual) / (kTukey * scale);
      const double tukey = far < 1 ? (1 - far * far) * (1 - far * far) : 0;
      here.weight =
          visible.at(i) * (iteration < 3 ? scale / std::max(scale, std::abs(here.residual)) : tukey);
      weights += here.weight;
    }
    if (weights < kCurve + 1) return false;
    variance = correlated_variance(side, weights);
  }
  return side.curve.allFinite() && weights >= kMinShare * static_cast<double>(side.planned);
}

/// The corner at which a side begins, and its places along the two sides.
bool intersect(Side& before, Side& after, Vector2d& corner) {
  constexpr int kIterations = 6;
  constexpr double kMaxDistance = 1.4;
  double a = before.end;
  double b = after.begin;
  for (int i = 0; i < kIterations; ++i) {
    Eigen::Matrix2d J;
    J << before.slope(a), -after.slope(b);
    const Vector2d step = J.inverse() * (after.at(b) - before.at(a));
    if (!step.allFinite()) return false;
    a += step.x();
    b += step.y();
    if (!(std::abs(a) < kMaxDistance && std::abs(b) < kMaxDistance)) return false;
  }
  before.end = a;
  after.begin = b;
  corner = 0.5 * (before.at(a) + after.at(b));
  return true;
}

Matrix8 covariance_of(const std::array<Side, 4>& sides) {
  constexpr double kModelPx = 0.03;  // bends that the curves do not contain
  Matrix8 ends = Matrix8::Zero();
  Matrix8 J = Matrix8::Zero();
  for (int k = 0; k < 4; ++k) {
    const Side& side = sides.at(static_cast<std::size_t>(k));
    Eigen::Matrix<double, 2, kCurve> at_ends;
    at_ends << legendre(side.begin).transpose(), legendre(side.end).transpose();
    ends.block<2, 2>(2 * k, 2 * k) = at_ends * side.covariance * at_ends.transpose();
    ends.block<2, 2>(2 * k, 2 * k).diagonal().array() += kModelPx * kModelPx;
    const int last = (k + 3) % 4;
    const Side& before = sides.at(static_cast<std::size_t>(last));
    Eigen::Matrix2d normals;
    normals << before.normal_at(before.end).transpose(), side.normal_at(side.begin).transpose();
    const Eigen::Matrix2d solved = normals.inverse();
    J.block<2, 1>(2 * k, 2 * last + 1) = solved.col(0);
    J.block<2, 1>(2 * k, 2 * k) = solved.col(1);
  }
  const Matrix8 corners = J * ends * J.transpose();
  return 0.5 * (corners + corners.transpose());
}

/// The curve between two corners as a bulge over the line between them.
Eigen::Vector3d bulge_of(const Side& side, const Vector2d& from, const Vector2d& to) {
  const Vector2d chord = to - from;
  const Vector2d normal = Vector2d(chord.y(), -chord.x()).normalized();
  Eigen::Matrix3d shape;
  Eigen::Vector3d bulge;
  for (int i = 0; i < 3; ++i) {
    const double share = 0.25 * (i + 1);
    const Vector2d px = side.at((1 - share) * side.begin + share * side.end) - from;
    const double t = 2 * chord.dot(px) / chord.squaredNorm() - 1;
    shape.row(i) = (1 - t * t) * Eigen::RowVector3d(1, t, t * t);
    bulge[i] = normal.dot(px);
  }
  return shape.inverse() * bulge;
}

}  // namespace

std::optional<CurvedBorder> follow_border(const ImageView& image, const PrintedTag& print,
                                          const Quad& near_px) {
  constexpr int kRounds = 4;
  constexpr double kReachCells = 0.8;  // the border is one cell wide, and so may be the margin
  constexpr double kFinalReachPx = 3;
  constexpr double kMarginPx = 1.5;
  const int cells = family(print.id.family).width_at_border;
  std::array<Side, 4> sides;
  for (std::size_t k = 0; k < 4; ++k) sides[k] = Side(near_px[k], near_px[(k + 1) % 4], cells);
  CurvedBorder border;
  for (int round = 0; round < kRounds; ++round) {
    for (Side& side : sides) {
      if (!(side.cell_px > 0)) return std::nullopt;
      const double widest = kReachCells * side.cell_px;
      const double reach =
          round == 0 ? widest : std::min(widest, std::max(kFinalReachPx, widest / (2 << round)));
      const double margin = round == 0 ? 0.5 * side.cell_px : kMarginPx;
      find_crossings(image, print.outwards(), {reach, std::max(0.5, reach / 10), margin}, side);
      if (!fit_curve(side)) return std::nullopt;
    }
    for (std::size_t k = 0; k < 4; ++k)
      if (!intersect(sides[(k + 3) % 4], sides[k], border.corners_px[k])) return std::nullopt;
  }
  border.covariance_px2 = covariance_of(sides);
  double squares = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    border.bulge_px[k] = bulge_of(sides[k], border.corners_px[k], border.corners_px[(k + 1) % 4]);
    if (!border.bulge_px[k].allFinite()) return std::nullopt;
    border.contrast += 0.25 * sides[k].rise;
    for (std::size_t i = 0; i < sides[k].count; ++i) {
      const Crossing& here = sides[k].crossings[i];
      squares += here.weight * here.residual * here.residual;
      border.crossings += here.weight > 0 ? 1 : 0;
    }
  }
  border.noise_px = std::sqrt(squares / std::max(1, border.crossings));
  if (!border.covariance_px2.allFinite()) return std::nullopt;
  return border;
}

namespace {

/// A step between two cells inside the border.
struct SheetStep {
  int axis = 0;
  double s = 0, t = 0;        ///< its place, from -1 to 1
  double offset = 0;          ///< [cell] from its place on a sheet that is bent as the border is
  double offset_if_flat = 0;  ///< [cell] from its place on a flat sheet with the same corners
  double weight = 0;
};

/// Places on a sheet that is bent as its border is (a Coons patch).
class BentSheet {
 public:
  BentSheet(const CurvedBorder& border, int cells)
      : half_(0.5 * cells),
        edges_(edge_frames(border.corners_px, cells)),
        px_H_cell_(edges_[0].cell_H_px.inverse()) {
    for (std::size_t k = 0; k < 4; ++k) edges_[k].bulge_px = border.bulge_px[k];
  }

  [[nodiscard]] Vector2d flat(double u, double v) const {
    return (px_H_cell_ * Eigen::Vector3d(u, v, 1)).hnormalized();
  }

  /// How far the bends move a place [px].
  [[nodiscard]] Vector2d bend(double u, double v) const {
    const auto of = [&](std::size_t k, double at_u, double at_v) -> Vector2d {
      const EdgeFrame& edge = edges_[k];
      const Vector2d chord = edge.to - edge.from;
      const double t = 2 * chord.dot(flat(at_u, at_v) - edge.from) / chord.squaredNorm() - 1;
      return edge.bulge_at(t) * edge.normal;
    };
    const double s = 0.5 * u / half_;
    const double t = 0.5 * v / half_;
    return (1 - t) * of(0, u, 0) + t * of(2, u, 2 * half_) + s * of(1, 2 * half_, v) + (1 - s) * of(3, 0, v);
  }

 private:
  double half_ = 0;
  std::array<EdgeFrame, 4> edges_;
  Eigen::Matrix3d px_H_cell_;
};

/// Measures one step; its weight is 0 if there is none.
SheetStep measure(const ImageView& image, const BentSheet& sheet, int axis, double u, double v, bool rises) {
  constexpr int kSamples = 10;
  constexpr double kReach = 0.44;  // cells to either side
  constexpr double kApart = 2 * kReach / (kSamples - 1);
  constexpr double kLeastWeight = 25;
  const Vector2d bend = sheet.bend(u, v);
  const Vector2d here = sheet.flat(u, v);
  Eigen::Matrix2d px_per_cell;
  px_per_cell << sheet.flat(u + 0.5, v) - sheet.flat(u - 0.5, v),
      sheet.flat(u, v + 0.5) - sheet.flat(u, v - 0.5);
  const Vector2d across = px_per_cell.col(axis);
  SheetStep step{.axis = axis};
  double before = 0;
  double moment = 0;
  for (int k = 0; k < kSamples; ++k) {
    const Vector2d px = here + bend + (k * kApart - kReach) * across;
    const double level = (rises ? 1 : -1) * sample_bilinear(image, px.x(), px.y());
    const double rise = k == 0 ? 0 : std::max(0.0, level - before);
    before = level;
    step.weight += rise * rise;
    moment += rise * rise * (k - 0.5);
  }
  if (step.weight < kLeastWeight) return {};
  step.offset = moment / step.weight * kApart - kReach;
  step.offset_if_flat = step.offset + Vector2d(px_per_cell.inverse() * bend)[axis];
  step.weight = std::sqrt(step.weight);
  return step;
}

constexpr std::size_t kMaxSheetSteps = 2 * static_cast<std::size_t>(kMaxCells) * kMaxCells;

struct SheetSteps {
  std::array<SheetStep, kMaxSheetSteps> step{};
  std::size_t count = 0;
};

void measure_all(const ImageView& image, const PrintedTag& print, const BentSheet& sheet, SheetSteps& steps) {
  const BitCells pattern(print);
  const int cells = family(print.id.family).width_at_border;
  for (int line = 1; line < cells; ++line) {
    for (int along = 0; along < cells; ++along) {
      for (const int axis : {0, 1}) {
        const float before = axis == 0 ? pattern.at(line - 1, along) : pattern.at(along, line - 1);
        const float after = axis == 0 ? pattern.at(line, along) : pattern.at(along, line);
        if (std::abs(after - before) < 1) continue;  // the same, or one of them is unknown
        const double u = axis == 0 ? line : along + 0.5;
        const double v = axis == 0 ? along + 0.5 : line;
        SheetStep step = measure(image, sheet, axis, u, v, after > before);
        if (!(step.weight > 0) || steps.count == kMaxSheetSteps) continue;
        step.s = 2 * u / cells - 1;
        step.t = 2 * v / cells - 1;
        steps.step.at(steps.count++) = step;
      }
    }
  }
}

constexpr double kBeyondCells = 0.3;  ///< the offsets of steps that are not where they are expected

/// Least squares with Tukey weights. Returns the mean of the squared offsets that remain, each at most
/// kBeyondCells squared.
template <int Unknowns, class Row, class Offset>
double fit_steps(const SheetSteps& steps, const Eigen::Matrix<double, Unknowns, 1>& sigma, const Row& row,
                 const Offset& offset, double& in_place) {
  constexpr double kStepCells = 0.05;
  constexpr double kInPlaceCells = 0.15;
  constexpr int kIterations = 4;
  using Vector = Eigen::Matrix<double, Unknowns, 1>;
  using Matrix = Eigen::Matrix<double, Unknowns, Unknowns>;
  Vector x = Vector::Zero();
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Matrix information = (kStepCells / sigma.array()).square().matrix().asDiagonal();
    Vector gradient = Vector::Zero();
    for (std::size_t i = 0; i < steps.count; ++i) {
      const SheetStep& step = steps.step[i];
      const Vector r = row(step);
      const double far = iteration == 0 ? 0 : std::abs(offset(step) - r.dot(x)) / kBeyondCells;
      const double weight = far < 1 ? (1 - far * far) * (1 - far * far) : 0;
      information += weight * r * r.transpose();
      gradient += weight * offset(step) * r;
    }
    x = information.ldlt().solve(gradient);
  }
  double sum = 0;
  double weights = 0;
  in_place = 0;
  for (std::size_t i = 0; i < steps.count; ++i) {
    const SheetStep& step = steps.step[i];
    const double off = std::abs(offset(step) - row(step).dot(x));
    sum += step.weight * std::pow(std::min(off, kBeyondCells), 2);
    weights += step.weight;
    in_place += off < kInPlaceCells ? step.weight : 0;
  }
  in_place /= std::max(1e-9, weights);
  return sum / std::max(1e-9, weights);
}

}  // namespace

bool BitsOnSheet::confirm_curves() const {
  constexpr int kMinSteps = 12;
  constexpr double kMinInPlace = 0.85;
  constexpr double kBetter = 0.6;
  return steps >= kMinSteps && in_place >= kMinInPlace && if_curved < kBetter * if_flat;
}

BitsOnSheet bits_on_sheet(const ImageView& image, const PrintedTag& print, const CurvedBorder& border) {
  SheetSteps steps;
  measure_all(image, print, BentSheet(border, family(print.id.family).width_at_border), steps);
  BitsOnSheet bits;
  bits.steps = static_cast<int>(steps.count);
  // A bent sheet moves the cells along its sides too, and its middle.
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  Vector6 stretch;
  stretch << 0.4, 0.15, 0.15, 0.4, 0.15, 0.15;  // [cell]
  const auto curved = [](const SheetStep& step) {
    Vector6 row = Vector6::Zero();
    const double at = step.axis == 0 ? step.s : step.t;
    row.segment<3>(3 * step.axis) = (1 - at * at) * Eigen::Vector3d(1, step.s, step.t);
    return row;
  };
  bits.if_curved = fit_steps<6>(
      steps, stretch, curved, [](const SheetStep& step) { return step.offset; }, bits.in_place);
  const auto flat = [](const SheetStep& step) {
    Eigen::Matrix<double, 8, 1> row = Eigen::Matrix<double, 8, 1>::Zero();
    const double at = step.axis == 0 ? step.s : step.t;
    row.segment<3>(3 * step.axis) << 1, step.s, step.t;
    row.tail<2>() << at * step.s, at * step.t;
    return row;
  };
  double ignored = 0;
  bits.if_flat = fit_steps<8>(
      steps, Eigen::Matrix<double, 8, 1>::Constant(1.0), flat,
      [](const SheetStep& step) { return step.offset_if_flat; }, ignored);
  return bits;
}

}  // namespace waymark::refinement
