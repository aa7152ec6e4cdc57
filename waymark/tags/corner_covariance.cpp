#include "waymark/tags/corner_covariance.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <Eigen/LU>

#include "waymark/tags/light.hpp"

namespace waymark::refinement {
namespace {

/// What the residuals say about the image and the model.
struct Residuals {
  double noise_variance = 0;  ///< of a pixel [grey level^2]
  double misfit_variance =
      0;  ///< what the steep pixels show on top of it: the blur is not the model's Gaussian
};

/// Noise shows in the pixels beside the edge, where the model is flat; misfit in those on the edge. Small
/// tags have few of the first kind and lean on the total and on the misfit expected of any camera.
Residuals split_residuals(const TagBands& tag, double step) {
  constexpr double kPriorPixels = 50;
  constexpr double kPriorMisfit = 0.01;  // of the step
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

/// Where the true blur is not the model's Gaussian, the fitted place of an edge swings around the true one
/// with the phase of the edge on the pixel grid. Phases differ along a slanted edge and average out; along a
/// level one they do not. This is the covariance of (kFrom, kTo) when the swing is a sine of the phase with
/// variance `variance` and any phase.
Eigen::Matrix2d phase_covariance(const EdgeFrame& edge, double variance) {
  constexpr double kTurn = 0.45;  // measured: edges turn less than the sine would have them
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

/// Displacement variance both ends of an edge share because the model leaves something out.
double shared_variance(const EdgeFrame& edge, double blur_px, double model_error_px) {
  constexpr double kCrowded = 0.1;  // measured: what blurs in from further cells than the model knows
  const double crowded_px = kCrowded * blur_px * std::pow(blur_px / edge.cell_px, 2);
  return model_error_px * model_error_px + crowded_px * crowded_px;
}

/// Light that grows along an edge looks like an edge that turns: the least squares fit of a shift to
/// (1 + light t) times the levels. The covariance of (kFrom, kTo) of all edges that light leaves uncertain.
Matrix8 light_covariance(const TagEstimate& estimate, const TagBands& tag, double noise_variance) {
  const double step = estimate.mean[kStep - kOwn];
  const double level = estimate.mean[kInnerLevel - kOwn] + 0.5 * step;  // on the edge
  const double blur_px = std::exp(estimate.mean[kLogBlur - kOwn]);
  // Integral of pdf (inner + step cdf) over that of pdf^2.
  const double px_per_light = 2.0 * std::sqrt(std::numbers::pi) * blur_px * level / step;
  Eigen::Matrix<double, 8, 2> turn;
  for (int k = 0; k < 4; ++k) {
    const EdgeFrame& edge = tag.edges[static_cast<std::size_t>(k)];
    turn.row(2 * k + kFrom) = 0.5 * px_per_light * (edge.to - edge.from).transpose();
    turn.row(2 * k + kTo) = -turn.row(2 * k + kFrom);
  }
  const LightInformation light = light_information(tag, estimate.light_per_px, noise_variance);
  return turn * light.information.inverse() * turn.transpose();
}

}  // namespace

Matrix8 corner_covariance(const TagSolve& solve, const TagEstimate& estimate, const TagBands& tag,
                          double model_error_px) {
  constexpr double kPhasePerMisfit = 3.5;  // measured: swing per misfit, in blurs per step
  const double step = estimate.mean[kStep - kOwn];
  const double blur_px = std::exp(estimate.mean[kLogBlur - kOwn]);
  const Residuals residuals = split_residuals(tag, step);
  const double swing_px =
      kPhasePerMisfit * blur_px * std::sqrt(residuals.misfit_variance) / std::max(1.0, std::abs(step));
  Matrix8 covariance = (residuals.noise_variance / estimate.noise_variance) * solve.displacement_covariance();
  covariance += light_covariance(estimate, tag, residuals.noise_variance);
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
