#include "waymark/tags/pattern_fit.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/LU>

namespace waymark::refinement {
namespace {

using Eigen::Vector2d;

PatternPoint point_at(const PatternFit& fit) {
  const TagVector& x = fit.x;
  PatternPoint point{};
  const Eigen::Matrix3d tag_H_x = homography_of(x).inverse();
  for (int i = 0; i < 9; ++i) point.tag_H_x[i] = static_cast<float>(tag_H_x(i / 3, i % 3));
  point.half_cells = 0.5F * static_cast<float>(fit.pattern.cells);
  const double blur_x = std::exp(x[kLogBlur]) / fit.pixels.unit_px;
  const double square = blur_x * blur_x;
  point.round_x2 = static_cast<float>(square);
  point.blur_x2[0] = static_cast<float>(square * (1 + x[kStretch]));
  point.blur_x2[1] = static_cast<float>(square * x[kStretch + 1]);
  point.blur_x2[2] = static_cast<float>(square * (1 - x[kStretch]));
  point.halo = static_cast<float>(x[kHalo]);
  for (int i = 0; i < 3; ++i) {
    point.black[i] = static_cast<float>(x[kBlackPlane + i]);
    point.step[i] = static_cast<float>(x[kStepPlane + i]);
  }
  point.growth = static_cast<float>(std::expm1(x[kGrowth]));
  for (int i = 0; i < 4; ++i) point.lens[i] = static_cast<float>(x[kLens + i]);
  point.radial[0] = static_cast<float>(fit.radial.x());
  point.radial[1] = static_cast<float>(fit.radial.y());
  return point;
}

/// Calls with (parameter, value expected, weight).
template <class Expect>
void each_prior(const TagPriors& priors, const TagVector& x, double unit_px, Expect&& expect) {
  const auto around = [&](int i, double value, double sigma) { expect(i, value, 1 / (sigma * sigma)); };
  const double step = std::max(5.0, std::abs(x[kStepPlane]));
  constexpr double kFaintPx = 3;  // a tag of which nothing is seen stays where it is
  for (int i = kHomography; i < kHomography + 8; ++i) around(i, x[i], kFaintPx / unit_px);
  for (const int i : {1, 2}) {
    around(kBlackPlane + i, 0, priors.black_slope * step);
    around(kStepPlane + i, 0, priors.step_slope * step);
  }
  around(kGrowth, 0, priors.growth);
  around(kLogBlur, std::log(priors.blur_px), priors.log_blur);
  around(kStretch, 0, priors.stretch);
  around(kStretch + 1, 0, priors.stretch);
  around(kHalo, 0, priors.halo);
  for (int i = 0; i < 4; ++i) {
    constexpr double kNone = 1e-9;
    around(kLens + i, 0, std::max(kNone, priors.lens[static_cast<std::size_t>(i)]));
    around(kRim + i, 0, priors.rim);
  }
}

}  // namespace

Eigen::Matrix3d homography_of(const TagVector& x) {
  Eigen::Matrix3d H;
  H << x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], 1;
  return H;
}

Eigen::Matrix<double, 2, 4> lens_bends(const PatternFit& fit, const Vector2d& place) {
  const double q2 = place.squaredNorm();
  const double along = fit.radial.dot(place);
  const Vector2d across(-fit.radial.y(), fit.radial.x());
  Eigen::Matrix<double, 2, 4> bends;
  bends << q2 * fit.radial, q2 * across, along * along * fit.radial, q2 * place;
  return bends;
}

Vector2d place_of_corner(const PatternFit& fit, int corner) {
  const double u = corner == 1 || corner == 2 ? 1 : -1;
  const double v = corner >= 2 ? 1 : -1;
  const Eigen::Vector3d p = homography_of(fit.x) * Eigen::Vector3d(u, v, 1);
  const Vector2d straight = p.head<2>() / p.z();
  Vector2d place = straight;
  for (int i = 0; i < 2; ++i) place = straight - lens_bends(fit, place) * fit.x.segment<4>(kLens);
  return place;
}

Eigen::Matrix<double, 8, kTagParameters> corners_by_parameters(const PatternFit& fit) {
  Eigen::Matrix<double, 8, kTagParameters> J = Eigen::Matrix<double, 8, kTagParameters>::Zero();
  const Eigen::Matrix3d H = homography_of(fit.x);
  for (Eigen::Index k = 0; k < 4; ++k) {
    const double u = k == 1 || k == 2 ? 1 : -1;
    const double v = k >= 2 ? 1 : -1;
    const Eigen::Vector3d p = H * Eigen::Vector3d(u, v, 1);
    const double x = p.x() / p.z();
    const double y = p.y() / p.z();
    Eigen::Matrix<double, 2, 8> by;
    by << u, v, 1, 0, 0, 0, -x * u, -x * v,  //
        0, 0, 0, u, v, 1, -y * u, -y * v;
    J.block<2, 8>(2 * k, kHomography) = by / p.z();
    J.block<2, 4>(2 * k, kLens) = -lens_bends(fit, {x, y});
  }
  return J;
}

void measure(bool with_information, PatternFit& fit, SumPattern sum_pattern) {
  TagPixels& pixels = fit.pixels;
  for (PixelBlock& block : pixels.used()) {
    for (int lane = 0; lane < kLanes; ++lane)
      block.rim_level[lane] =
          block.side[lane] < 0 ? 0.0F : static_cast<float>(fit.x[kRim + block.side[lane]]);
  }
  fit.sums = sum_pattern(pixels.rows(), point_at(fit), with_information, fit.blocks.data());
}

double residual_variance(const PatternFit& fit) {
  constexpr double kQuantisation = 1.0 / 12.0;
  const double freedom = static_cast<double>(fit.sums.pixels) - static_cast<double>(kTagParameters);
  return std::max(kQuantisation, static_cast<double>(fit.sums.cost) / std::max(1.0, freedom));
}

void set_information(PatternFit& fit) {
  fit.noise_variance = residual_variance(fit);
  TagMatrix& information = fit.information;
  information.setZero();
  for (int i = 0; i < kShared; ++i) {
    for (int k = i; k < kShared; ++k) {
      information(i, k) = static_cast<double>(fit.sums.information[i][k]);
      information(k, i) = information(i, k);
    }
  }
  for (std::size_t b = 0; b < static_cast<std::size_t>(fit.pixels.blocks); ++b) {
    if (!fit.pixels.block[b].rim_matters) continue;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const int side = fit.pixels.block[b].side[lane];
      if (side < 0) continue;
      const int at = kRim + side;
      for (int k = 0; k < kShared; ++k) information(at, k) += static_cast<double>(fit.blocks[b].rim[k][lane]);
      information(at, at) += static_cast<double>(fit.blocks[b].rim[kShared][lane]);
    }
  }
  information.topRightCorner<kShared, 4>() = information.bottomLeftCorner<4, kShared>().transpose();
  information /= fit.noise_variance;
  each_prior(fit.priors, fit.x, fit.pixels.unit_px,
             [&](int i, double, double weight) { information(i, i) += weight; });
}

TagVector gradient_of(const PatternFit& fit) {
  TagVector gradient = TagVector::Zero();
  for (int i = 0; i < kShared; ++i) gradient[i] = static_cast<double>(fit.sums.gradient[i]);
  for (std::size_t c = 0; c < static_cast<std::size_t>(fit.pixels.blocks) * kLanes; ++c) {
    const int side = fit.pixels.block[c / kLanes].side[c % kLanes];
    if (side < 0) continue;
    gradient[kRim + side] += static_cast<double>(fit.blocks[c / kLanes].gradient[kShared][c % kLanes]);
  }
  gradient /= fit.noise_variance;
  each_prior(fit.priors, fit.x, fit.pixels.unit_px,
             [&](int i, double value, double weight) { gradient[i] += weight * (value - fit.x[i]); });
  return gradient;
}

}  // namespace waymark::refinement
