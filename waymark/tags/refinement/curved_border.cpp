#include "waymark/tags/refinement/curved_border.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "waymark/samples/tag_detection.hpp"

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
  double t = 0;                         ///< along the chord, -1 to 1
  CurveVector p = CurveVector::Zero();  ///< polynomials at t
  double out_px = 0;                    ///< distance outwards from the chord
  double weight = 0;                    ///< 0 if it is not on the curve
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
    const CurveVector p = legendre(t);
    const double middle = side.curve.dot(p);
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
    side.crossings.at(side.count++) = {t, p, begin + moment / weight * search.step_px, 1, 0};
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
      const CurveVector weighted = here.weight / variance * here.p;
      information.noalias() += weighted * here.p.transpose();
      gradient += here.out_px * weighted;
    }
    const Eigen::LLT<CurveMatrix> solver(information);
    side.curve = solver.solve(gradient);
    if (iteration + 1 == kIterations) side.covariance = solver.solve(CurveMatrix::Identity());
    for (std::size_t i = 0; i < side.count; ++i) {
      Crossing& here = side.crossings.at(i);
      here.residual = here.out_px - side.curve.dot(here.p);
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

/// The outward normal of a side at its end `t`, -1 or 1.
Vector2d end_normal(const CurvedBorder& border, std::size_t side, double t) {
  const Vector2d half = 0.5 * (border.corners_px[(side + 1) % 4] - border.corners_px[side]);
  const Eigen::Vector3d& bulge = border.bulge_px[side];
  const double slope_px = -2 * t * (bulge[0] + t * bulge[1] + bulge[2]);
  const Vector2d outwards = Vector2d(half.y(), -half.x()).normalized();
  const Vector2d along = half + slope_px * outwards;
  return Vector2d(along.y(), -along.x()).normalized();
}

/// Variance of the bends that the curves do not contain [px^2]: the next orders are expected to be as much
/// smaller as the last ones are. The weights were learnt from rendered tags on bent sheets.
double variance_of_missing_bends(const Eigen::Vector3d& bulge_px) {
  constexpr double kThirdOrder = 0.045;
  constexpr double kFourthOrder = 0.067;
  return std::pow(kThirdOrder * bulge_px[1], 2) + std::pow(kFourthOrder * bulge_px[2], 2);
}

Matrix8 covariance_of(const std::array<Side, 4>& sides, const std::array<Eigen::Vector3d, 4>& bulge_px) {
  Matrix8 ends = Matrix8::Zero();
  Matrix8 J = Matrix8::Zero();
  for (Eigen::Index k = 0; k < 4; ++k) {
    const Side& side = sides.at(static_cast<std::size_t>(k));
    Eigen::Matrix<double, 2, kCurve> at_ends;
    at_ends << legendre(side.begin).transpose(), legendre(side.end).transpose();
    ends.block<2, 2>(2 * k, 2 * k) = at_ends * side.covariance * at_ends.transpose();
    ends.block<2, 2>(2 * k, 2 * k).diagonal().array() +=
        variance_of_missing_bends(bulge_px.at(static_cast<std::size_t>(k)));
    const Eigen::Index last = (k + 3) % 4;
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

/// How far the middle of a side bulges from the line between its ends.
double mid_bulge_px(const Side& side) {
  const auto out_px = [&](double t) { return side.curve.dot(legendre(t)); };
  return out_px(0.5 * (side.begin + side.end)) - 0.5 * (out_px(side.begin) + out_px(side.end));
}

}  // namespace

std::optional<CurvedBorder> follow_border(const ImageView& image, const PrintedTag& print,
                                          const Quad& near_px, double least_bulge_px) {
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
    if (round == 0 && std::none_of(sides.begin(), sides.end(), [&](const Side& side) {
          return std::abs(mid_bulge_px(side)) >= least_bulge_px;
        }))
      return std::nullopt;
  }
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
  border.covariance_px2 = covariance_of(sides, border.bulge_px);
  if (!border.covariance_px2.allFinite()) return std::nullopt;
  return border;
}

bool is_curved(const CurvedBorder& border) {
  constexpr double kStraightPx = 0.08;
  int curved = 0;
  for (const Eigen::Vector3d& bulge : border.bulge_px) curved += std::abs(bulge[0]) > kStraightPx ? 1 : 0;
  return curved >= 2;
}

void move_outwards(double distance_px, double sigma_px, CurvedBorder& border) {
  Eigen::Matrix<double, 8, 1> moved;  // by a distance of one pixel
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t last = (k + 3) % 4;
    Eigen::Matrix2d normals;
    normals << end_normal(border, last, 1).transpose(), end_normal(border, k, -1).transpose();
    const Vector2d corner = normals.inverse() * Vector2d::Ones();
    if (!corner.allFinite()) return;
    moved.segment<2>(2 * static_cast<Eigen::Index>(k)) = corner;
  }
  for (std::size_t k = 0; k < 4; ++k)
    border.corners_px[k] += distance_px * moved.segment<2>(2 * static_cast<Eigen::Index>(k));
  border.covariance_px2 += sigma_px * sigma_px * moved * moved.transpose();
}

}  // namespace waymark::refinement
