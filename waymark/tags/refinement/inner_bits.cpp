#include "waymark/tags/refinement/inner_bits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "waymark/families/family.hpp"
#include "waymark/tags/refinement/edge_model.hpp"
#include "waymark/tags/refinement/edge_sums.hpp"

namespace waymark::refinement {
namespace {

/// The share of white (0 or 1) in each cell inside the border square of a tag; 0.5 if unknown.
class BitCells {
 public:
  /// The id must exist in the family. O(cells).
  explicit BitCells(const PrintedTag& print) : cells_(family(print.id.family).width_at_border) {
    const TagId& id = print.id;
    const Family& table = family(id.family);
    white_.fill(0.5F);
    const float border = print.bright_border() ? 1.0F : 0.0F;
    for (int i = 0; i < cells_; ++i)
      for (const int edge : {0, cells_ - 1}) white(i, edge) = white(edge, i) = border;
    const std::uint64_t code = table.codes[static_cast<std::size_t>(id.number)];
    for (std::size_t bit = 0; bit < table.bits.size(); ++bit) {
      const auto [x, y] = table.bits[bit];
      if (x < 0 || y < 0 || x >= cells_ || y >= cells_) continue;
      const bool one = ((code >> (table.bits.size() - 1 - bit)) & 1U) != 0;
      white(x, y) = one != print.inverted ? 1.0F : 0.0F;
    }
  }

  /// Share of white in the cell at column x and row y; outside the square, that of the colour outside the
  /// border.
  [[nodiscard]] float at(int x, int y) const {
    if (x < 0 || y < 0 || x >= cells_ || y >= cells_) return 1.0F - white_[0];
    return white_[at_index(x, y)];
  }

 private:
  static std::size_t at_index(int x, int y) {
    return static_cast<std::size_t>(y) * kMaxCells + static_cast<std::size_t>(x);
  }
  float& white(int x, int y) { return white_[at_index(x, y)]; }

  int cells_ = 0;
  std::array<float, static_cast<std::size_t>(kMaxCells) * kMaxCells> white_{};
};

using Eigen::Vector2d;

constexpr double kRimCells = 0.6;  ///< pixels nearer to the border edges are left to the fit of the border

/// Position of a pixel relative to the cells.
struct Place {
  std::array<double, 2> cell{};         ///< u and v
  std::array<double, 2> px_per_cell{};  ///< across the lines u = const and v = const
  double skew = 0;                      ///< cosine of the angle between the normals of these lines
};

Place locate(const Eigen::Matrix3d& cell_H_px, const Vector2d& px) {
  const Eigen::Vector3d h = cell_H_px * px.homogeneous();
  Place place;
  std::array<Eigen::RowVector2d, 2> normal;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto row = static_cast<Eigen::Index>(axis);
    place.cell[axis] = h[row] / h[2];
    const Eigen::RowVector2d slope =
        cell_H_px.block<1, 2>(row, 0) - place.cell[axis] * cell_H_px.block<1, 2>(2, 0);
    place.px_per_cell[axis] = std::abs(h[2]) / slope.norm();
    normal[axis] = slope / slope.norm();
  }
  place.skew = normal[0].dot(normal[1]);
  return place;
}

double along(double cell, int cells) { return 2.0 * cell / cells - 1.0; }

/// Displacement of the print at (s, t) due to the lens and the fitted curvature of the four edges [px].
Vector2d bend_px(const TagBands& tag, const TagEstimate& estimate, double s, double t) {
  const auto of = [&](std::size_t k, double at) -> Vector2d {
    return (1 - at * at) * estimate.edges[k][kBend] * tag.edges[k].normal;
  };
  const Vector2d lens = tag.lens ? tag.lens->at(s, t) : Vector2d::Zero();
  return lens + 0.5 * ((1 - t) * of(0, s) + (1 + t) * of(2, -s) + (1 + s) * of(1, t) + (1 - s) * of(3, -t));
}

bool bends_matter(const TagBands& tag, const TagEstimate& estimate) {
  constexpr double kNegligiblePx = 0.02;
  if (tag.lens)
    for (const Vector2d& off : tag.lens->off_px)
      if (off.cwiseAbs().maxCoeff() > kNegligiblePx) return true;
  for (std::size_t k = 0; k < 4; ++k) {
    if (std::abs(estimate.edges[k][kBend]) > kNegligiblePx) return true;
  }
  return false;
}

double area_px2(const TagBands& tag) {
  double twice = 0;
  for (const EdgeFrame& edge : tag.edges) twice += edge.from.x() * edge.to.y() - edge.from.y() * edge.to.x();
  return 0.5 * twice;
}

/// Visits all pixels of the tag, or `most` of them distributed evenly over it (Roberts, "The unreasonable
/// effectiveness of quasirandom sequences", 2018).
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

/// Puts a pixel into its lane. Returns false if a cell around it is unknown.
bool put(const BitCells& pattern, const Place& place, int cells, int lane, InnerPixels::Block& block) {
  std::array<int, 2> first{};  // indices of the first of the three lines
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
  block.skew[lane] = static_cast<float>(place.skew);
  block.s[lane] = static_cast<float>(along(place.cell[0], cells));
  block.t[lane] = static_cast<float>(along(place.cell[1], cells));
  return true;
}

}  // namespace

void read_inner_pixels(const ImageView& image, const PrintedTag& print, const TagBands& tag,
                       const TagEstimate& estimate, int most, InnerPixels& pixels) {
  const int cells = family(print.id.family).width_at_border;
  const BitCells pattern(print);
  const bool bent = bends_matter(tag, estimate);
  const Eigen::Matrix3d& cell_H_px = tag.edges[0].cell_H_px;
  const Vector2d middle =
      0.25 * (tag.edges[0].from + tag.edges[1].from + tag.edges[2].from + tag.edges[3].from);
  pixels.count = 0;
  each_pixel(tag, cells, most, [&](int x, int y) {
    if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
    if (pixels.count == InnerPixels::kMaxBlocks * kLanes) return;
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
    const double illumination = 1.0 + estimate.illumination_per_px.dot(px - middle);
    block.value[lane] = static_cast<float>(image.row(y)[x] / illumination);
    block.weight[lane] = 1;
    ++pixels.count;
  });
  if (pixels.count % kLanes == 0) return;  // the last block is full, or there is none
  InnerPixels::Block& last = pixels.block[pixels.blocks() - 1];
  for (int lane = pixels.count % kLanes; lane < kLanes; ++lane) {
    const auto repeat = [lane](Lanes& lanes) {
      lanes[lane] = lanes[0];
    };  // have weight 0, but must be finite
    for (Lanes* lanes : {&last.value, &last.s, &last.t, &last.skew}) repeat(*lanes);
    std::ranges::for_each(last.px_per_cell, repeat);
    for (auto& axis : last.past_px) std::ranges::for_each(axis, repeat);
    for (auto& axis : last.place) std::ranges::for_each(axis, repeat);
    for (auto& row : last.white) std::ranges::for_each(row, repeat);
    last.weight[lane] = 0;
  }
}

namespace {

/// In blurs: up to this growth, the second-order expansion is accurate to a thousandth of the step.
constexpr float kMaxSmallGrowth = 0.3F;

/// Share of white at several pixels, and its derivatives.
struct Share {
  Lanes white, growth;
  std::array<Lanes, 2> blur, shift, stretch, squeeze;  ///< across columns and rows
};

/// The pattern across one axis: derivatives of the share of white with respect to displacements of its lines.
/// `cross` holds the weights of the four rows across it; `density` and `z` refer to the three lines.
struct Across {
  Lanes moved = Lanes::Zero();
  Lanes stretched = Lanes::Zero();
  Lanes squeezed = Lanes::Zero();
  Lanes blurred = Lanes::Zero();
  Lanes grown = Lanes::Zero();   ///< if white grows by one more blur
  Lanes growth = Lanes::Zero();  ///< contribution of the growth itself to the share of white
};

Across across(const InnerPixels::Block& block, std::size_t axis, const std::array<Lanes, 4>& cross,
              const std::array<Lanes, 3>& z, const std::array<Lanes, 3>& density, float outwards,
              float growth) {
  Across sum;
  for (std::size_t i = 0; i < 3; ++i) {
    Lanes jump = Lanes::Zero();   // lines where white begins count positive, those where it ends negative
    Lanes edges = Lanes::Zero();  // lines of either kind
    for (std::size_t j = 0; j < 4; ++j) {
      const Lanes& before = axis == 0 ? block.white[j][i] : block.white[i][j];
      const Lanes& after = axis == 0 ? block.white[j][i + 1] : block.white[i + 1][j];
      jump += cross[j] * (after - before);
      edges += cross[j] * (before + after - 2.0F * before * after);
    }
    // The fitted border is the true one minus the growth, so the lines inside are stretched with it.
    const Lanes place = outwards * block.place[axis][i];
    if (std::abs(growth) > kMaxSmallGrowth) {
      // Lines where white begins move by 1 - place; those where it ends move by 1 + place in the opposite
      // direction.
      const Lanes begins = 0.5F * (edges + jump);
      const Lanes ends = 0.5F * (edges - jump);
      const NormalLanes<Lanes> here = normal_lanes<Lanes>(z[i]);
      const NormalLanes<Lanes> begin = normal_lanes<Lanes>(z[i] + (1.0F - place) * growth);
      const NormalLanes<Lanes> end = normal_lanes<Lanes>(z[i] - (1.0F + place) * growth);
      const Lanes density_jump = begins * begin.pdf - ends * end.pdf;
      sum.moved -= density_jump;
      sum.stretched -= block.place[axis][i] * density_jump;
      sum.squeezed -= block.place[axis][i].square() * density_jump;
      sum.blurred -= z[i] * density_jump;
      sum.grown += begins * (1.0F - place) * begin.pdf + ends * (1.0F + place) * end.pdf;
      sum.growth += begins * (begin.cdf - here.cdf) + ends * (here.cdf - end.cdf);
      continue;
    }
    const Lanes first = edges - place * jump;
    const Lanes second = (1.0F + place.square()) * jump - 2.0F * place * edges;
    sum.moved -= density[i] * jump;
    sum.stretched -= density[i] * block.place[axis][i] * jump;
    sum.squeezed -= density[i] * block.place[axis][i].square() * jump;
    sum.blurred -= density[i] * z[i] * jump;
    sum.grown += density[i] * (first - growth * z[i] * second);
    sum.growth += density[i] * growth * (first - 0.5F * growth * z[i] * second);
  }
  return sum;
}

/// Outward displacements of the ends of the border edges along s and along t relative to the fitted ones, at
/// s = 1 and t = 1 [px].
std::array<double, 2> turns(const InnerVector& x, double outwards) {
  const double px = px_per_level(x, outwards);
  return {px * (x[kBlackS] + 0.5 * x[kWhiteS]), px * (x[kBlackT] + 0.5 * x[kWhiteT])};
}

/// Displacement of the lines across one axis, in blurs: a constant part, plus a part proportional to s or t.
struct Offset {
  Lanes shift, stretch;
  float squeeze = 0;
};

template <int Unknowns>
std::array<Offset, 2> offsets(const InnerPixels::Block& block, const InnerVector& x) {
  const auto of = [&x](InnerUnknown i) { return static_cast<float>(x[i]); };
  if constexpr (Unknowns == kUnknownsOnBorder) {
    return {Offset{Lanes::Constant(of(kShiftS)), Lanes::Constant(of(kStretchS))},
            {Lanes::Constant(of(kShiftT)), Lanes::Constant(of(kStretchT))}};
  } else {
    return {Offset{of(kShiftS) + of(kShearS) * block.t + of(kBendS) * block.t.square(),
                   of(kStretchS) + of(kTaperS) * block.t, of(kSqueezeS)},
            {of(kShiftT) + of(kShearT) * block.s + of(kBendT) * block.s.square(),
             of(kStretchT) + of(kTaperT) * block.s, of(kSqueezeT)}};
  }
}

/// Change in the share of white because columns and rows are not orthogonal. The displacements of a blurred
/// point across them are then correlated (first order of the bivariate normal distribution).
Lanes by_skew(const InnerPixels::Block& block, const std::array<std::array<Lanes, 3>, 2>& density) {
  Lanes sum = Lanes::Zero();
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column)
      sum += density[1][row] * density[0][column] *
             (block.white[row][column] - block.white[row][column + 1] - block.white[row + 1][column] +
              block.white[row + 1][column + 1]);
  return block.skew * sum;
}

/// Accurate to second order for a small growth and exact otherwise; accurate to first order in the shift. A
/// border with rotated edges (`keystone`) has the wrong perspective, which displaces its middle by the same
/// amount.
template <int Unknowns>
Share share_of_white(const InnerPixels::Block& block, const InnerVector& x, float outwards,
                     const std::array<double, 2>& keystone, bool skew_matters) {
  const auto growth = static_cast<float>(x[kGrowth]);
  std::array<std::array<Lanes, 3>, 2> z;
  std::array<std::array<Lanes, 3>, 2> density;
  std::array<std::array<Lanes, 4>, 2> part;  // shares of the blurred pixel in the four columns and rows
  const std::array<Offset, 2> offset = offsets<Unknowns>(block, x);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto inverse_blur = static_cast<float>(std::exp(-x[axis == 0 ? kBlurS : kBlurT]));
    const Lanes tapered = static_cast<float>(keystone[axis]) * inverse_blur * block.px_per_cell[axis] /
                          block.px_per_cell[1 - axis];
    Lanes rest = Lanes::Ones();
    for (std::size_t i = 0; i < 3; ++i) {
      z[axis][i] = block.past_px[axis][i] * inverse_blur - offset[axis].shift -
                   offset[axis].stretch * block.place[axis][i] -
                   offset[axis].squeeze * block.place[axis][i].square() +
                   tapered * (1.0F - block.place[axis][i].square());
      const NormalLanes<Lanes> normal = normal_lanes<Lanes>(z[axis][i]);
      density[axis][i] = normal.pdf;
      part[axis][i] = rest - normal.cdf;
      rest = normal.cdf;
    }
    part[axis][3] = rest;
  }
  Lanes white = Lanes::Zero();
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      white += part[1][row] * part[0][column] * block.white[row][column];
  if (skew_matters) white += by_skew(block, density);
  const Across s = across(block, 0, part[1], z[0], density[0], outwards, growth);
  const Across t = across(block, 1, part[0], z[1], density[1], outwards, growth);
  return {white + s.growth + t.growth, s.grown + t.grown,          {s.blurred, t.blurred},
          {s.moved, t.moved},          {s.stretched, t.stretched}, {s.squeezed, t.squeezed}};
}

}  // namespace

double mean_blur_px(const InnerVector& x) { return std::exp(0.5 * (x[kBlurS] + x[kBlurT])); }

double px_per_level(const InnerVector& x, double outwards) {
  return 2.0 * std::sqrt(std::numbers::pi) * mean_blur_px(x) / x[kWhite] * outwards;
}

template <int Unknowns>
InnerSums sum_up(const InnerPixels& pixels, const InnerVector& x, double outwards, double trusted) {
  constexpr auto kCount = static_cast<std::size_t>(Unknowns);
  std::array<std::array<Lanes, kCount>, kCount> information;
  std::array<Lanes, kCount> gradient;
  for (auto& row : information) row.fill(Lanes::Zero());
  gradient.fill(Lanes::Zero());
  Lanes cost = Lanes::Zero();
  Lanes count = Lanes::Zero();
  constexpr bool kOnBorder = Unknowns == kUnknownsOnBorder;
  const std::array<double, 2> keystone = kOnBorder ? turns(x, outwards) : std::array<double, 2>{};
  const auto of = [&x](InnerUnknown i) { return static_cast<float>(x[i]); };
  for (std::size_t b = 0; b < pixels.blocks(); ++b) {
    const InnerPixels::Block& block = pixels.block[b];
    const Share share =
        share_of_white<Unknowns>(block, x, static_cast<float>(outwards), keystone, pixels.skew_matters);
    const Lanes step = of(kWhite) + of(kWhiteS) * block.s + of(kWhiteT) * block.t;
    const Lanes predicted = of(kBlack) + of(kBlackS) * block.s + of(kBlackT) * block.t + step * share.white;
    const Lanes residual = block.value - predicted;
    // The weight is from Huber, "Robust estimation of a location parameter", 1964.
    Lanes weight = block.weight * (static_cast<float>(trusted) / residual.abs().max(1e-3F)).min(1.0F);
    weight *= sums::within_scale<Lanes>(block.value, predicted);
    std::array<Lanes, kCount> slope;
    slope[kBlack] = Lanes::Ones();
    slope[kBlackS] = block.s;
    slope[kBlackT] = block.t;
    slope[kWhite] = share.white;
    slope[kWhiteS] = share.white * block.s;
    slope[kWhiteT] = share.white * block.t;
    slope[kGrowth] = step * share.growth;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      slope[kBlurS + axis] = step * share.blur[axis];
      slope[kShiftS + axis] = step * share.shift[axis];
      slope[kStretchS + axis] = step * share.stretch[axis];
      if constexpr (!kOnBorder) {
        const Lanes& beside = axis == 0 ? block.t : block.s;
        slope[kShearS + axis] = slope[kShiftS + axis] * beside;
        slope[kTaperS + axis] = slope[kStretchS + axis] * beside;
        slope[kSqueezeS + axis] = step * share.squeeze[axis];
        slope[kBendS + axis] = slope[kShiftS + axis] * beside.square();
      }
    }
    for (std::size_t i = 0; i < kCount; ++i) {
      const Lanes weighted = weight * slope[i];
      for (std::size_t k = i; k < kCount; ++k) information[i][k] += weighted * slope[k];
      gradient[i] += weighted * residual;
    }
    cost += weight * residual.square();
    count += weight;
  }
  InnerSums sums;
  for (int i = 0; i < Unknowns; ++i) {
    const auto row = static_cast<std::size_t>(i);
    for (int k = i; k < Unknowns; ++k)
      sums.information(i, k) = sums.information(k, i) =
          static_cast<double>(information[row][static_cast<std::size_t>(k)].sum());
    sums.gradient[i] = static_cast<double>(gradient[row].sum());
  }
  sums.cost = static_cast<double>(cost.sum());
  sums.pixels = static_cast<double>(count.sum());
  return sums;
}

template InnerSums sum_up<kUnknownsOnBorder>(const InnerPixels&, const InnerVector&, double, double);
template InnerSums sum_up<kInnerUnknowns>(const InnerPixels&, const InnerVector&, double, double);

namespace {

constexpr std::array kSlopes = {kBlackS, kBlackT, kWhiteS, kWhiteT};

/// Conditions the estimate on some unknowns being 0. Returns the logarithm of the resulting likelihood ratio
/// (Dickey, "The weighted likelihood ratio", 1971).
template <std::size_t N>
double set_to_zero(const std::array<InnerUnknown, N>& which, const InnerPrior& prior,
                   InnerEstimate& estimate) {
  Eigen::Matrix<double, kInnerUnknowns, N> columns;
  Eigen::Matrix<double, N, 1> there;
  Eigen::Matrix<double, N, N> between;
  double log_ratio = 0;
  for (std::size_t i = 0; i < N; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    columns.col(at) = estimate.covariance.col(which[i]);
    there[at] = estimate.mean[which[i]];
    log_ratio += std::log(prior.sigma[which[i]]);
    for (std::size_t k = 0; k < N; ++k)
      between(at, static_cast<Eigen::Index>(k)) = estimate.covariance(which[i], which[k]);
  }
  const Eigen::Matrix<double, N, N> inverse = between.inverse();
  log_ratio -= 0.5 * std::log(between.determinant()) + 0.5 * there.dot(inverse * there);
  estimate.mean -= columns * (inverse * there);
  estimate.covariance -= columns * inverse * columns.transpose();
  return log_ratio;
}

}  // namespace

InnerPrior inner_prior(double black, double step, double log_blur, const InnerSigmas& sigmas) {
  constexpr double kGrowthBlurs = 0.25;
  InnerPrior prior;
  prior.mean[kBlack] = black;
  prior.mean[kWhite] = step;
  prior.mean[kBlurS] = prior.mean[kBlurT] = log_blur;
  prior.sigma[kBlack] = prior.sigma[kWhite] = sigmas.level * step;
  for (const InnerUnknown slope : kSlopes) prior.sigma[slope] = sigmas.slope * step;
  prior.sigma[kGrowth] = kGrowthBlurs;
  prior.sigma[kBlurS] = prior.sigma[kBlurT] = sigmas.log_blur;
  for (int i = kShiftS; i <= kTaperT; ++i) prior.sigma[i] = sigmas.place_blurs;
  constexpr double kMinSigma = 1e-3;  // because 0 has no inverse
  for (int i = kSqueezeS; i <= kBendT; ++i) prior.sigma[i] = std::max(kMinSigma, sigmas.bend_blurs);
  return prior;
}

InnerPrior saturated_prior(double black, double step, double log_blur, const InnerSigmas& sigmas) {
  constexpr double kBeyond = 3;  // expected step, in visible steps
  InnerPrior prior = inner_prior(black, step, log_blur, sigmas);
  prior.mean[kWhite] = kBeyond * step;
  prior.sigma[kWhite] = kBeyond * step;
  prior.sigma[kWhiteS] = prior.sigma[kWhiteT] = sigmas.slope * kBeyond * step;
  prior.blur_range = 1.0;
  prior.iterations = 10;
  return prior;
}

template <int Unknowns>
InnerEstimate gauss_newton(const InnerSums& sums, double variance, const InnerPrior& prior,
                           const InnerVector& precision, const InnerVector& x) {
  using Square = Eigen::Matrix<double, Unknowns, Unknowns>;
  Square information = sums.information.topLeftCorner<Unknowns, Unknowns>() / variance;
  information.diagonal() += precision.head<Unknowns>();
  const Square covariance = information.llt().solve(Square::Identity());
  InnerEstimate estimate{x, InnerMatrix::Zero()};
  estimate.covariance.topLeftCorner<Unknowns, Unknowns>() = covariance;
  estimate.mean.head<Unknowns>() +=
      covariance * (sums.gradient / variance + precision.cwiseProduct(prior.mean - x)).head<Unknowns>();
  return estimate;
}

template <int Unknowns>
InnerFit fit_inner(const InnerPixels& pixels, const InnerPrior& prior, const InnerVector& start,
                   double noise_variance, double outwards) {
  constexpr int kMoreIterations = 8;  // needed for a large growth, as in an overexposed print
  constexpr double kSlowGrowth = 0.3;
  constexpr double kMaxGrowth = 2.5;
  constexpr double kToleranceBlurs = 0.02;
  constexpr double kQuantisation = 1.0 / 12.0;
  constexpr double kPriorPixels = 20;
  constexpr double kWhiteTolerance = 0.01;
  constexpr double kWhiteFactor = 8;
  constexpr int kMaxIterationsWithFixedWhite = 3;  // white is known well enough
  InnerFit fit{{start, InnerMatrix::Zero()}, noise_variance, {}, start};
  InnerVector& x = fit.estimate.mean;
  const auto most = [&] {
    return std::max(prior.iterations, std::abs(x[kGrowth]) > kSlowGrowth ? kMoreIterations : 0);
  };
  for (int i = 0; i < most(); ++i) {
    fit.at = x;
    fit.sums = sum_up<Unknowns>(pixels, x, outwards, i == 0 ? 1e6 : 3 * std::sqrt(fit.variance));
    fit.variance = std::max(kQuantisation, (fit.sums.cost + kPriorPixels * noise_variance) /
                                               std::max(1.0, fit.sums.pixels + kPriorPixels - Unknowns));
    fit.estimate = gauss_newton<Unknowns>(fit.sums, fit.variance, prior, prior.precision(), x);
    for (const InnerUnknown blur : {kBlurS, kBlurT})
      x[blur] = std::clamp(x[blur], prior.mean[blur] - prior.blur_range, prior.mean[blur] + prior.blur_range);
    x[kGrowth] = std::clamp(x[kGrowth], -kMaxGrowth, kMaxGrowth);
    if (prior.iterations > kMaxIterationsWithFixedWhite)
      x[kWhite] = std::clamp(x[kWhite], prior.mean[kWhite] / kWhiteFactor, prior.mean[kWhite] * kWhiteFactor);
    const bool white_settled = prior.iterations <= kMaxIterationsWithFixedWhite ||
                               std::abs(x[kWhite] - fit.at[kWhite]) < kWhiteTolerance * x[kWhite];
    if (i > 0 && white_settled && std::abs(x[kGrowth] - fit.at[kGrowth]) < kToleranceBlurs) break;
  }
  return fit;
}

template InnerEstimate gauss_newton<kUnknownsOnBorder>(const InnerSums&, double, const InnerPrior&,
                                                       const InnerVector&, const InnerVector&);
template InnerFit fit_inner<kUnknownsOnBorder>(const InnerPixels&, const InnerPrior&, const InnerVector&,
                                               double, double);
template InnerFit fit_inner<kInnerUnknowns>(const InnerPixels&, const InnerPrior&, const InnerVector&, double,
                                            double);

double growth_sigma_px(const InnerVector& x) {
  constexpr double kShare = 0.06;
  return kShare * std::abs(x[kGrowth]) * mean_blur_px(x);
}

InnerEstimate averaged(const InnerFit& fit, const InnerPrior& prior) {
  constexpr double kModelBlurs = 0.01;  // error of the growth, because a blur is not exactly Gaussian
  // Prior odds against either effect: most images have neither, and deciding late costs little.
  constexpr double kLogOdds = 3;
  InnerEstimate all = fit.estimate;
  const double sigma = growth_sigma_px(all.mean) / mean_blur_px(all.mean);
  all.covariance(kGrowth, kGrowth) += kModelBlurs * kModelBlurs + sigma * sigma;
  std::array<InnerEstimate, 4> beliefs = {all, all, all, all};
  std::array<double, 4> log_weight{};
  for (std::size_t i = 0; i < 4; ++i) {
    if ((i & 1U) != 0) log_weight[i] += kLogOdds + set_to_zero(std::array{kGrowth}, prior, beliefs[i]);
    if ((i & 2U) != 0) log_weight[i] += kLogOdds + set_to_zero(kSlopes, prior, beliefs[i]);
  }
  const double most = *std::ranges::max_element(log_weight);
  double sum = 0;
  for (const double weight : log_weight) sum += std::exp(weight - most);
  InnerEstimate mean{InnerVector::Zero(), InnerMatrix::Zero()};
  for (std::size_t i = 0; i < 4; ++i) mean.mean += std::exp(log_weight[i] - most) / sum * beliefs[i].mean;
  for (std::size_t i = 0; i < 4; ++i) {
    const InnerVector off = beliefs[i].mean - mean.mean;
    mean.covariance += std::exp(log_weight[i] - most) / sum * (beliefs[i].covariance + off * off.transpose());
  }
  return mean;
}

EdgesByInner edges_by_growth(const InnerVector& x, double outwards) {
  EdgesByInner J = EdgesByInner::Zero();
  J.col(kGrowth).setConstant(outwards * mean_blur_px(x));
  return J;
}

namespace {

/// The priors: levels and blur are close to those of the border, and the pattern is placed by the border.
InnerPrior prior_of(const TagEstimate& estimate, bool reversed) {
  const double step = std::abs(estimate.mean[kStep - kOwn]);
  const double black = estimate.mean[kInnerLevel - kOwn] - (reversed ? step : 0);
  return inner_prior(black, step, estimate.mean[kLogBlur - kOwn], {});
}

/// Derivatives of the outward displacements (kFrom, kTo) of the four edges with respect to the unknowns.
EdgesByInner edges_by_unknowns(const InnerVector& x, double outwards) {
  EdgesByInner J = edges_by_growth(x, outwards);
  constexpr std::array<double, 4> kDirection = {1, 1, -1, -1};  // direction of each edge along s or t
  for (int k = 0; k < 4; ++k) {
    const int from = 2 * k + kFrom;
    const int to = 2 * k + kTo;
    const double turn = kDirection[static_cast<std::size_t>(k)] * px_per_level(x, outwards);
    J(to, k % 2 == 0 ? kBlackS : kBlackT) = turn;
    J(from, k % 2 == 0 ? kBlackS : kBlackT) = -turn;
    J(to, k % 2 == 0 ? kWhiteS : kWhiteT) = 0.5 * turn;
    J(from, k % 2 == 0 ? kWhiteS : kWhiteT) = -0.5 * turn;
  }
  return J;
}

/// Distance of the border edges from their positions according to the bits alone, in standard deviations of
/// the difference; the largest of the four edges.
double contradiction(const InnerFit& fit, const InnerPrior& prior) {
  const double floor_px = std::hypot(0.03, growth_sigma_px(fit.estimate.mean));  // print and curvature errors
  InnerVector precision = prior.precision();
  for (const InnerUnknown free : {kShiftS, kShiftT, kStretchS, kStretchT}) precision[free] = 1.0;
  for (const InnerUnknown slope : kSlopes) precision[slope] /= 25;
  const InnerEstimate free =
      gauss_newton<kUnknownsOnBorder>(fit.sums, fit.variance, prior, precision, fit.at);
  const double blur_px = mean_blur_px(fit.estimate.mean);
  double worst = 0;
  for (const double side : {-1.0, 1.0}) {
    for (const auto& [shift, stretch] : {std::pair(kShiftS, kStretchS), std::pair(kShiftT, kStretchT)}) {
      const double off_px = blur_px * (free.mean[shift] + side * free.mean[stretch]);
      const double variance = free.covariance(shift, shift) + free.covariance(stretch, stretch) +
                              2 * side * free.covariance(shift, stretch);
      worst =
          std::max(worst, std::abs(off_px) / std::sqrt(blur_px * blur_px * variance + floor_px * floor_px));
    }
  }
  return worst;
}

}  // namespace

EdgeCorrection inner_correction(const ImageView& image, const PrintedTag& print, const TagBands& tag,
                                const TagEstimate& estimate) {
  const bool reversed = print.bright_border();
  const double outwards = print.outwards();
  InnerPixels pixels;
  read_inner_pixels(image, print, tag, estimate, InnerPixels::kCorrectionPixels, pixels);
  const InnerPrior prior = prior_of(estimate, reversed);
  const InnerFit all =
      fit_inner<kUnknownsOnBorder>(pixels, prior, prior.mean, estimate.noise_variance, outwards);
  EdgeCorrection correction;
  if (!all.estimate.mean.allFinite()) return correction;
  correction.worst_sigmas = contradiction(all, prior);
  const InnerEstimate corrected = averaged(all, prior);
  const EdgesByInner J = edges_by_unknowns(corrected.mean, outwards);
  correction.outwards_px = J * corrected.mean;
  correction.covariance_px2 = J * corrected.covariance * J.transpose();
  return correction;
}

}  // namespace waymark::refinement
