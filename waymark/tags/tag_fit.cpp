#include "waymark/tags/tag_fit.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "waymark/samples/corners.hpp"
#include "waymark/tags/tag_steps.hpp"

namespace waymark::refinement {
namespace {

using Eigen::Vector2d;

/// Homography from the square of -1 to 1 to the quad (Heckbert, "Fundamentals of texture mapping and image
/// warping", 1989, section 2.2.3), its last entry 1.
Eigen::Matrix3d homography_of_square(const Quad& q) {
  const Vector2d u = q[1] - q[2];
  const Vector2d v = q[3] - q[2];
  const Vector2d s = q[0] - q[1] + q[2] - q[3];
  const double det = u.x() * v.y() - u.y() * v.x();
  const double g = (s.x() * v.y() - s.y() * v.x()) / det;
  const double h = (u.x() * s.y() - u.y() * s.x()) / det;
  Eigen::Matrix3d H;
  H << q[1].x() - q[0].x() + g * q[1].x(), q[3].x() - q[0].x() + h * q[3].x(), q[0].x(),  //
      q[1].y() - q[0].y() + g * q[1].y(), q[3].y() - q[0].y() + h * q[3].y(), q[0].y(),   //
      g, h, 1.0;
  Eigen::Matrix3d unit;  // -1 to 1 becomes 0 to 1
  unit << 0.5, 0, 0.5, 0, 0.5, 0.5, 0, 0, 1;
  H *= unit;
  return H / H(2, 2);
}

void set_corners(const Quad& corners, TagFit& fit) {
  TagPixels& pixels = fit.pattern.pixels;
  pixels.middle_px = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  pixels.unit_px = 0.5 * mean_side_px(corners);
  Quad scaled;
  for (std::size_t k = 0; k < 4; ++k)
    scaled[k] = (fit.straightening.straight(corners[k]) - pixels.middle_px) / pixels.unit_px;
  const Eigen::Matrix3d H = homography_of_square(scaled);
  for (int i = 0; i < 8; ++i) fit.pattern.x[i] = H(i / 3, i % 3);
}

PixelLimits pixel_limits(const TagFit& fit, const Quad& corners) {
  const TagVector& x = fit.pattern.x;
  PixelLimits limits;
  limits.blur_px = std::exp(x[kLogBlur]) * (1 + 0.5 * std::hypot(x[kStretch], x[kStretch + 1]));
  limits.cell_px = smallest_cell_px(corners, fit.pattern.pattern.cells);
  limits.blur_cells = limits.blur_px / limits.cell_px;
  limits.outside_cells = std::clamp(std::max(2.5, 3.5 * limits.blur_px) / limits.cell_px, 0.3, 0.9);
  return limits;
}

/// How far lines may bend that should be straight: by a tenth of what the camera's lens does to them; without
/// a camera by what an unknown lens may. That one has its centre somewhere near the image's middle and bends
/// lines in proportion to their distance from there: `curvature_per_px` at the image's corners.
void expect_bends(const ImageView& image, double curvature_per_px, const Quad& corners, TagFit& fit) {
  constexpr double kDoubtInDistortion = 0.1;
  constexpr double kDoubtInCentre = 0.25;  // share of half the image's diagonal
  const TagPixels& pixels = fit.pattern.pixels;
  auto& sigma = fit.pattern.priors.lens;
  const Vector2d half_px(0.5 * image.width, 0.5 * image.height);
  const Vector2d from_middle = pixels.middle_px - half_px;
  const double radius = from_middle.norm();
  fit.pattern.radial = radius > 1 ? Vector2d(from_middle / radius) : Vector2d(1, 0);
  if (fit.straightening.moves()) {
    double shift_px = 0;
    for (const Vector2d& corner : corners)
      shift_px = std::max(shift_px, fit.straightening.shift(corner).norm());
    sigma.fill(kDoubtInDistortion * shift_px / (2 * pixels.unit_px));
    return;
  }
  const double share = radius / half_px.norm();
  const double bend = 0.5 * curvature_per_px * pixels.unit_px;
  sigma = {bend * (share + kDoubtInCentre), bend * kDoubtInCentre, bend * share,
           bend * pixels.unit_px / half_px.norm()};
}

/// What the residuals of neighbouring pixels have in common: standard deviation [grey level].
double systematic_residual(const PatternFit& fit) {
  double squares = 0;  // of sums over clusters
  double pixels = 0;
  double pixels2 = 0;
  for (std::size_t b = 0; b < static_cast<std::size_t>(fit.pixels.blocks); ++b) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const auto weight = static_cast<double>(fit.pixels.block[b].cluster_weight[lane]);
      const auto sum = static_cast<double>(fit.blocks[b].gradient[kBlackPlane][lane]);
      const double count = weight * static_cast<double>(fit.blocks[b].pixels[lane]);
      squares += sum * sum;
      pixels += count;
      pixels2 += count * count;
    }
  }
  // Noise alone leaves squares of `pixels` times its variance.
  const double excess = squares - pixels * residual_variance(fit);
  return std::sqrt(std::max(0.0, excess / std::max(1.0, pixels2 - pixels)));
}

}  // namespace

Quad corners_of(const TagFit& fit) {
  Quad corners;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d place = place_of_corner(fit.pattern, static_cast<int>(k));
    corners[k] =
        fit.straightening.distorted(fit.pattern.pixels.middle_px + fit.pattern.pixels.unit_px * place);
  }
  return corners;
}

double smallest_cell_px(const Quad& corners, int cells) {
  double least = 1e300;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d a = corners[(k + 1) % 4] - corners[k];
    const Vector2d b = corners[(k + 3) % 4] - corners[k];
    const double area = std::abs(a.x() * b.y() - a.y() * b.x());
    least = std::min({least, area / a.norm(), area / b.norm()});
  }
  return least / cells;
}

void start_fit(const TagDetection& detection, const RefinementOptions& options, const CameraModel* camera,
               TagFit& fit) {
  fit.pattern.pattern = tag_pattern(detection.tag);
  if (camera != nullptr)
    fit.straightening = Straightening::of(*camera, detection.corners_px).value_or(Straightening());
  fit.pattern.priors.blur_px = options.blur_px;
  fit.pattern.x[kLogBlur] = std::log(options.blur_px);
  set_corners(detection.corners_px, fit);
}

bool read_tag(const ImageView& image, const Quad& corners, TagFit& fit) {
  return read_pixels(image, fit.pattern.pattern, fit.straightening, homography_of(fit.pattern.x),
                     pixel_limits(fit, corners), fit.pattern.pixels);
}

Look look(const ImageView& image, const RefinementOptions& options, const Quad& corners, bool first,
          TagFit& fit) {
  PatternFit& pattern = fit.pattern;
  const PixelLimits limits = pixel_limits(fit, corners);
  if (!read_tag(image, corners, fit)) return {};
  if (first) {
    expect_bends(image, options.curvature_per_px, corners, fit);
    constexpr double kLostInBlur = 1.6;
    pattern.x.segment<6>(kBlackPlane).setZero();
    pattern.x[kBlackPlane] = pattern.pixels.black;
    pattern.x[kStepPlane] =
        (pattern.pixels.white - pattern.pixels.black) / std::max(0.3, 1 - kLostInBlur * limits.blur_cells);
  }
  Look look = iterate(!first, fit);
  constexpr double kMoreBlur = 1.3;  // then other pixels matter
  look.settled =
      look.moved_px < kSettledPx && pixel_limits(fit, corners).blur_px < kMoreBlur * limits.blur_px;
  // So far may a pixel be from where it was read until another line of cells matters to it.
  look.reach_px = (pattern.pixels.steps > 2 ? 0.4 : 0.2) * limits.cell_px;
  return look;
}

Certainty certainty_of(const TagFit& fit, double model_error_px) {
  const PatternFit& pattern = fit.pattern;
  Eigen::Matrix<double, 8, kTagParameters> J = corners_by_parameters(pattern) * pattern.pixels.unit_px;
  const Quad corners = corners_of(fit);
  for (Eigen::Index k = 0; k < 4; ++k) {
    const Eigen::Matrix2d bent =
        fit.straightening.distorted_by_straight(corners[static_cast<std::size_t>(k)]);
    J.middleRows<2>(2 * k) = (bent * J.middleRows<2>(2 * k)).eval();
  }
  const Eigen::Matrix<double, kTagParameters, 8> gain = fit.solver.solve(J.transpose());
  Matrix8 covariance = J * gain;
  // How much more the clusters pull than independent noise of their pixels would have them (Huber, "The
  // behavior of maximum likelihood estimates under nonstandard conditions", Berkeley Symposium 1967; here as
  // one factor).
  Matrix8 pulls = Matrix8::Zero();
  const Eigen::Matrix<float, 8, kTagParameters> by =
      (gain.transpose() / pattern.noise_variance).cast<float>();
  for (std::size_t b = 0; b < static_cast<std::size_t>(pattern.pixels.blocks); ++b) {
    const Eigen::Map<const Eigen::Matrix<float, kShared + 1, kLanes, Eigen::RowMajor>> gradient(
        pattern.blocks[b].gradient[0]);
    Eigen::Matrix<float, 8, kLanes> pull = by.leftCols<kShared>() * gradient.topRows<kShared>();
    for (int lane = 0; lane < kLanes; ++lane) {
      const int side = pattern.pixels.block[b].side[lane];
      if (side >= 0) pull.col(lane) += by.col(kRim + side) * gradient(kShared, lane);
    }
    pulls += (pull * pull.transpose()).cast<double>();
  }
  const Eigen::LLT<Matrix8> whiten(covariance);
  const double scale = pattern.noise_variance / residual_variance(pattern);
  const double excess = scale * whiten.solve(pulls).trace() / 8;
  constexpr double kChance = 0.92;  // the pulls of so few clusters swing by some 0.2
  covariance *= std::max(1.0, kChance * excess) * (residual_variance(pattern) / pattern.noise_variance);
  covariance.diagonal().array() += model_error_px * model_error_px;
  const double step = std::max(1.0, std::abs(pattern.x[kStepPlane]));
  return {.covariance_px2 = 0.5 * (covariance + covariance.transpose()),
          .excess = excess,
          .residual = std::sqrt(residual_variance(pattern)) / step,
          .systematic = systematic_residual(pattern) / step};
}

}  // namespace waymark::refinement
