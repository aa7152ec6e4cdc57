#include "waymark/tags/refinement/tag_fit.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <Eigen/LU>

namespace waymark::refinement {
namespace {

constexpr int kMinPixels = 40;
constexpr int kMinPixelsPerEdge = 8;

BandLimits band_limits(const EdgeFrame& edge, double blur_px, bool first_pass) {
  constexpr double kSearchPx = 0.7;
  const double reach = std::max(2.5, 3.5 * blur_px) + (first_pass ? kSearchPx : 0.0);
  BandLimits limits;
  limits.cells_matter = edge.cell_px < reach + 3.0 * blur_px;
  // The model for one row of bits ends beyond the middle of the border, because margins are often cut to one
  // cell.
  limits.inside_px = limits.cells_matter ? std::min(reach, 0.8 * edge.cell_px) : reach;
  limits.outside_px = limits.cells_matter ? std::min(reach, edge.cell_px) : reach;
  limits.max_slices =
      first_pass ? kMaxSlices / 4 : kMaxSlices;  // an approximate position is enough for the first pass
  limits.corner_margin_px = std::min((limits.cells_matter ? 2.0 : 2.5) * blur_px, 0.25 * edge.length_px);
  return limits;
}

/// One value for each slice of each edge.
using SliceValues = std::array<float, 4 * kMaxSlices>;

double median(SliceValues& values, std::size_t first, std::size_t last) {
  if (first == last) return 0.0;
  const auto at = [&](std::size_t i) { return values.begin() + static_cast<std::ptrdiff_t>(i); };
  const auto middle = at(first + (last - first) / 2);
  std::nth_element(at(first), middle, at(last));
  return static_cast<double>(*middle);
}

using SliceMeans = SliceCosts;  ///< mean costs per pixel

Lanes slice_pixels(const Band& band, std::size_t b) {
  Lanes count = Lanes::Zero();
  for (std::size_t j = 0; j < static_cast<std::size_t>(band.depth); ++j) count += band.weight[b][j];
  return count;
}

/// Returns the number of pixels dropped.
int drop_slices_above(float limit, const SliceMeans& means, Band& band) {
  int dropped = 0;
  for (std::size_t b = 0; b < static_cast<std::size_t>(band.blocks); ++b) {
    if ((means[b] <= limit).all()) continue;
    const Lanes keep = (means[b] <= limit).select(Lanes::Ones(), 0.0F);
    dropped += static_cast<int>((slice_pixels(band, b) * (1.0F - keep)).sum() + 0.5F);
    for (std::size_t j = 0; j < static_cast<std::size_t>(band.depth); ++j) band.weight[b][j] *= keep;
  }
  band.pixels -= dropped;
  return dropped;
}

}  // namespace

double level_at_rim(const TagBands& tag, bool outermost) {
  SliceValues values;
  std::size_t count = 0;
  for (const Band& band : tag.bands) {
    for (int s = 0; s < band.slices; ++s) {
      const auto b = static_cast<std::size_t>(s / kLanes);
      for (int step = 0; step < band.depth; ++step) {
        const auto j = static_cast<std::size_t>(outermost ? band.depth - 1 - step : step);
        if (band.weight[b][j][s % kLanes] == 0.0F) continue;
        values[count++] = band.value[b][j][s % kLanes];
        break;
      }
    }
  }
  return median(values, 0, count);
}

bool read_bands(const ImageView& image, const std::array<Surroundings, 4>& near, double blur_px,
                bool first_pass, TagBands& tag) {
  tag.pixels = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const BandLimits limits = band_limits(tag.edges[k], blur_px, first_pass);
    read_band(image, tag.edges[k], near[k], limits, blur_px, tag.bands[k]);
    if (tag.bands[k].pixels < kMinPixelsPerEdge) return false;
    tag.pixels += tag.bands[k].pixels;
  }
  return tag.pixels >= kMinPixels;
}

double linearize_all(const std::array<EdgeVector, 4>& edges, const Eigen::Vector2d& illumination_per_px,
                     TagBands& tag) {
  double cost = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const double illumination = 0.5 * illumination_per_px.dot(tag.edges[k].to - tag.edges[k].from);
    tag.normals[k] = linearize(tag.bands[k], edges[k], illumination, tag.costs[k]);
    cost += tag.normals[k].cost;
  }
  return cost;
}

DroppedSlices drop_outliers(TagBands& tag) {
  std::array<SliceMeans, 4> means;
  SliceValues values;
  std::size_t count = 0;
  std::array<double, 4> medians{};
  for (std::size_t k = 0; k < 4; ++k) {
    const Band& band = tag.bands[k];
    const std::size_t first = count;
    for (std::size_t b = 0; b < static_cast<std::size_t>(band.blocks); ++b) {
      const Lanes pixels = slice_pixels(band, b);
      means[k][b] = tag.costs[k][b] / pixels.max(1.0F);
      for (int lane = 0; lane < kLanes; ++lane) {
        if (pixels[lane] > 0.0F) values[count++] = means[k][b][lane];
      }
    }
    medians[k] = median(values, first, count);
  }
  const double usual = median(values, 0, count);
  constexpr double kOutOfProportion = 16.0;  // corresponds to four times the usual residual
  constexpr double kOfOwnEdge = 4.0;
  DroppedSlices dropped;
  for (std::size_t k = 0; k < 4; ++k) {
    // A covered part of an edge also biases the fit of that edge away from good slices, so those are kept for
    // now.
    const double limit = std::max(kOutOfProportion * (usual + 0.25), kOfOwnEdge * medians[k]);
    dropped.pixels += drop_slices_above(static_cast<float>(limit), means[k], tag.bands[k]);
    dropped.enough_left = dropped.enough_left && tag.bands[k].pixels >= kMinPixelsPerEdge;
  }
  tag.pixels -= dropped.pixels;
  dropped.enough_left = dropped.enough_left && tag.pixels >= kMinPixels;
  return dropped;
}

// Along an edge with half span e, the illumination is 1 + t per_px . e, with t from -1 to 1. This is linear
// least squares over the flat pixels of all edges: residual = predicted t (per_px . e).
IlluminationInformation illumination_information(const TagBands& tag,
                                                 const Eigen::Vector2d& illumination_per_px,
                                                 double noise_variance) {
  constexpr double kUsualPerPx = 0.00025;  // a VGA image a sixth brighter on one side than on the other
  constexpr double kPrior = 1.0 / (kUsualPerPx * kUsualPerPx);
  IlluminationInformation illumination;
  illumination.information = kPrior * Eigen::Matrix2d::Identity();
  Eigen::Vector2d gradient = -kPrior * illumination_per_px;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d half_span = 0.5 * (tag.edges[k].to - tag.edges[k].from);
    illumination.information +=
        tag.normals[k].illumination_information / noise_variance * half_span * half_span.transpose();
    gradient += tag.normals[k].illumination_gradient / noise_variance * half_span;
  }
  illumination.step_per_px = illumination.information.inverse() * gradient;
  return illumination;
}

namespace {

constexpr int kMeanStep = kStep - kOwn;
constexpr int kMeanLogBlur = kLogBlur - kOwn;

double precision(double sigma) { return 1.0 / (sigma * sigma); }

}  // namespace

TagSolve::TagSolve(const std::array<NormalEquations, 4>& normals, const Priors& priors,
                   const TagEstimate& at) {
  const double step = std::max(1.0, std::abs(at.mean[kMeanStep]));
  tie_ << precision(priors.inner_level * step), precision(priors.step * step), precision(priors.log_blur);
  const double scale = 1.0 / at.noise_variance;
  CommonMatrix mean_information = CommonMatrix::Zero();
  Common mean_gradient = Common::Zero();
  // Even an invisible edge keeps its position to within about a pixel; actual data outweigh this by a factor
  // of a thousand.
  constexpr double kFaint = 0.1;
  constexpr double kNegligible = 1e-4;
  for (std::size_t k = 0; k < 4; ++k) {
    const EdgeVector& x = at.edges[k];
    EdgeMatrix information = scale * normals[k].information;
    EdgeVector gradient = scale * normals[k].gradient;
    const auto expect = [&](int i, double value, double weight) {
      information(i, i) += weight;
      gradient[i] += weight * (value - x[i]);
    };
    expect(kFrom, 0.0, kFaint);
    expect(kTo, 0.0, kFaint);
    expect(kBend, 0.0, precision(std::max(priors.bend_sigma_px[k], kNegligible)));
    expect(kBeyond, 0.0, precision(priors.beyond * step));

    Edge& edge = edges_[k];
    const Coupling cross = information.topRightCorner<kOwn, kCommon>();
    edge.own_covariance = information.topLeftCorner<kOwn, kOwn>().inverse();
    edge.own_by_common = edge.own_covariance * cross;
    edge.own_step = edge.own_covariance * gradient.head<kOwn>();
    CommonMatrix common = information.bottomRightCorner<kCommon, kCommon>();
    common -= cross.transpose() * edge.own_by_common;
    common.diagonal() += tie_;
    edge.common_covariance = common.inverse();
    const Common from_mean = at.mean - x.tail<kCommon>();
    const Common pull =
        gradient.tail<kCommon>() - cross.transpose() * edge.own_step + Common(tie_.cwiseProduct(from_mean));
    edge.common_step = edge.common_covariance * pull;
    // The derivative with respect to the mean is zero: sum over edges of tie (mean - common) = 0.
    mean_information.diagonal() += tie_;
    mean_information -= tie_.asDiagonal() * edge.common_covariance * tie_.asDiagonal();
    mean_gradient += tie_.cwiseProduct(edge.common_step - from_mean);
  }
  const double blur_precision = precision(priors.mean_log_blur);
  mean_information(kMeanLogBlur, kMeanLogBlur) += blur_precision;
  mean_gradient[kMeanLogBlur] += blur_precision * (std::log(priors.blur_px) - at.mean[kMeanLogBlur]);
  mean_covariance_ = mean_information.inverse();
  mean_step_ = mean_covariance_ * mean_gradient;
}

double TagSolve::apply(TagEstimate& estimate) const {
  std::array<EdgeVector, 4> steps;
  double moved = 0;
  double blurred = std::abs(mean_step_[kMeanLogBlur]);
  for (std::size_t k = 0; k < 4; ++k) {
    const Edge& edge = edges_[k];
    const Common common = edge.common_step + edge.common_covariance * tie_.cwiseProduct(mean_step_);
    steps[k] << edge.own_step - edge.own_by_common * common, common;
    moved = std::max(moved, steps[k].head<2>().cwiseAbs().maxCoeff());
    blurred = std::max(blurred, std::abs(steps[k][kLogBlur]));
  }
  constexpr double kLongestPx = 1.0;
  constexpr double kLargestLogBlur = 0.5;
  const double shorten =
      std::min({1.0, kLongestPx / std::max(moved, 1e-9), kLargestLogBlur / std::max(blurred, 1e-9)});
  for (std::size_t k = 0; k < 4; ++k) estimate.edges[k] += shorten * steps[k];
  estimate.mean += shorten * mean_step_;
  // A blur narrower than a pixel or wider than a band means divergence, so it is limited to the valid range
  // of the model.
  const auto keep = [](double& log_blur) { log_blur = std::clamp(log_blur, std::log(0.25), std::log(4.0)); };
  keep(estimate.mean[kMeanLogBlur]);
  for (EdgeVector& x : estimate.edges) keep(x[kLogBlur]);
  return moved;
}

Eigen::Matrix<double, 8, 8> TagSolve::displacement_covariance() const {
  Eigen::Matrix<double, 8, 8> covariance;
  for (int k = 0; k < 4; ++k) {
    const Edge& row = edges_[static_cast<std::size_t>(k)];
    const Eigen::Matrix<double, 2, kCommon> by_mean =
        row.own_by_common.topRows<2>() * row.common_covariance * tie_.asDiagonal();
    for (int l = k; l < 4; ++l) {
      const Edge& column = edges_[static_cast<std::size_t>(l)];
      Eigen::Matrix2d block = by_mean * mean_covariance_ * tie_.asDiagonal() * column.common_covariance *
                              column.own_by_common.topRows<2>().transpose();
      if (k == l) {
        block += row.own_covariance.topLeftCorner<2, 2>();
        block += row.own_by_common.topRows<2>() * row.common_covariance *
                 row.own_by_common.topRows<2>().transpose();
      }
      covariance.block<2, 2>(2 * k, 2 * l) = block;
      covariance.block<2, 2>(2 * l, 2 * k) = block.transpose();
    }
  }
  return covariance;
}

namespace {

/// Image noise and model misfit, both estimated from the residuals.
struct Residuals {
  double noise_variance = 0;   ///< variance of a pixel [grey level^2]
  double misfit_variance = 0;  ///< additional variance of the steep pixels, because the blur differs from the
                               ///< Gaussian of the model
};

/// Noise is estimated from the pixels next to the edge, where the model is flat, and misfit from the pixels
/// on the edge. Small tags have few flat pixels, so for them the estimate relies on the total and on the
/// prior misfit of cameras.
Residuals split_residuals(const TagBands& tag, double step) {
  constexpr double kPriorPixels = 50;
  constexpr double kPriorMisfit = 0.01;  // relative to the step
  double cost = 0;
  double flat_cost = 0;
  double flat_pixels = 0;
  double pixels = 0;
  for (const NormalEquations& normal : tag.normals) {
    pixels += normal.pixels();
    cost += normal.cost;
    flat_cost += normal.flat_cost;
    flat_pixels += normal.flat_pixels;
  }
  pixels = std::max(pixels, kParametersOfTag + 1.0);
  const double total = cost / pixels;
  const double flat = std::min(total, (flat_cost + kPriorPixels * total) / (flat_pixels + kPriorPixels));
  const double steep = (cost - flat_cost) / std::max(1.0, pixels - flat_pixels);
  const double expected = kPriorMisfit * kPriorMisfit * step * step;
  constexpr double kQuantisation = 1.0 / 12.0;
  const double freedom = pixels / (pixels - kParametersOfTag);
  return {
      std::max(freedom * flat, kQuantisation),
      (flat_pixels * std::max(0.0, steep - flat) + kPriorPixels * expected) / (flat_pixels + kPriorPixels)};
}

/// If the true blur is not Gaussian as in the model, the fitted position of an edge oscillates around the
/// true one with its phase on the pixel grid. Along a slanted edge the phases vary and average out; along an
/// axis-parallel edge they do not. This is the covariance of (kFrom, kTo) if the oscillation is a sine of the
/// phase with variance `variance` and the phase is uniformly distributed.
Eigen::Matrix2d phase_covariance(const EdgeFrame& edge, double variance) {
  constexpr double kTurn = 0.45;  // measured; edges rotate less than the sine predicts
  const double crossed_px = edge.length_px * std::min(std::abs(edge.normal.x()), std::abs(edge.normal.y()));
  const double u = std::numbers::pi * crossed_px;
  const bool level = u < 1e-3;
  const double offset = level ? 1.0 : std::sin(u) / u;
  const double turn = level ? 0.0 : kTurn * 3.0 * (std::sin(u) - u * std::cos(u)) / (u * u);
  const double both = offset * offset * variance;
  const double opposite = turn * turn * variance;
  Eigen::Matrix2d covariance;
  covariance << both + opposite, both - opposite, both - opposite, both + opposite;
  return covariance;
}

/// Variance of the displacement common to both ends of an edge, due to model errors.
double shared_variance(const EdgeFrame& edge, double blur_px, double model_error_px) {
  constexpr double kCrowded = 0.1;  // measured; blur from cells that the model does not contain
  const double crowded_px = kCrowded * blur_px * std::pow(blur_px / edge.cell_px, 2);
  return model_error_px * model_error_px + crowded_px * crowded_px;
}

/// An illumination gradient along an edge appears as a rotation of the edge: the least squares fit of a shift
/// to (1 + illumination t) times the levels. This is the covariance of (kFrom, kTo) for all edges due to the
/// uncertainty of the illumination.
Matrix8 illumination_covariance(const TagEstimate& estimate, const TagBands& tag, double noise_variance) {
  const double step = estimate.mean[kStep - kOwn];
  const double level = estimate.mean[kInnerLevel - kOwn] + 0.5 * step;  // level on the edge itself
  const double blur_px = std::exp(estimate.mean[kLogBlur - kOwn]);
  // The integral of pdf (inner + step cdf), divided by that of pdf^2.
  const double px_per_illumination = 2.0 * std::sqrt(std::numbers::pi) * blur_px * level / step;
  Eigen::Matrix<double, 8, 2> turn;
  for (int k = 0; k < 4; ++k) {
    const EdgeFrame& edge = tag.edges[static_cast<std::size_t>(k)];
    turn.row(2 * k + kFrom) = 0.5 * px_per_illumination * (edge.to - edge.from).transpose();
    turn.row(2 * k + kTo) = -turn.row(2 * k + kFrom);
  }
  const IlluminationInformation illumination =
      illumination_information(tag, estimate.illumination_per_px, noise_variance);
  return turn * illumination.information.inverse() * turn.transpose();
}

}  // namespace

Matrix8 corner_covariance(const TagSolve& solve, const TagEstimate& estimate, const TagBands& tag,
                          double model_error_px) {
  constexpr double kPhasePerMisfit = 3.5;  // measured: oscillation in blurs per relative misfit
  const double step = estimate.mean[kStep - kOwn];
  const double blur_px = std::exp(estimate.mean[kLogBlur - kOwn]);
  const Residuals residuals = split_residuals(tag, step);
  const double swing_px =
      kPhasePerMisfit * blur_px * std::sqrt(residuals.misfit_variance) / std::max(1.0, std::abs(step));
  Matrix8 covariance = (residuals.noise_variance / estimate.noise_variance) * solve.displacement_covariance();
  covariance += illumination_covariance(estimate, tag, residuals.noise_variance);
  for (int k = 0; k < 4; ++k) {
    const EdgeFrame& edge = tag.edges[static_cast<std::size_t>(k)];
    covariance.block<2, 2>(2 * k, 2 * k) += phase_covariance(edge, swing_px * swing_px);
    covariance.block<2, 2>(2 * k, 2 * k).array() += shared_variance(edge, blur_px, model_error_px);
  }
  const Matrix8 J = intersection(tag.edges);
  Matrix8 corners = J * covariance * J.transpose();
  constexpr double kFloorPx = 1e-3;
  corners.diagonal().array() += kFloorPx * kFloorPx;
  return 0.5 * (corners + corners.transpose());
}

Matrix8 intersection(const std::array<EdgeFrame, 4>& edges) {
  Matrix8 J = Matrix8::Zero();
  for (int k = 0; k < 4; ++k) {
    const int before = (k + 3) % 4;
    Eigen::Matrix2d normals;
    normals.row(0) = edges[static_cast<std::size_t>(before)].normal.transpose();
    normals.row(1) = edges[static_cast<std::size_t>(k)].normal.transpose();
    const Eigen::Matrix2d solved = normals.inverse();
    J.block<2, 1>(2 * k, 2 * before + kTo) = solved.col(0);
    J.block<2, 1>(2 * k, 2 * k + kFrom) = solved.col(1);
  }
  return J;
}

}  // namespace waymark::refinement
