#include "waymark/tags/tag_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "waymark/samples/corners.hpp"

namespace waymark::refinement {
namespace {

using Eigen::Vector2d;

constexpr int kMaxIterations = 6;
constexpr double kShapeOfBlur = 1.08;  ///< measured: variance that a blur which is no Gaussian adds
constexpr double kFoundPx = 0.1;       ///< a step that is good enough to look again
constexpr double kSettledPx = 0.01;    ///< a step after which the next one is far below what noise allows

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
  Quad scaled;
  fit.pixels.middle_px = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  fit.pixels.unit_px = 0.5 * mean_side_px(corners);
  for (std::size_t k = 0; k < 4; ++k) {
    scaled[k] = (fit.straightening.straight(corners[k]) - fit.pixels.middle_px) / fit.pixels.unit_px;
  }
  const Eigen::Matrix3d H = homography_of_square(scaled);
  for (int i = 0; i < 8; ++i) fit.state.x[i] = H(i / 3, i % 3);
}

PixelLimits pixel_limits(const TagFit& fit, const Quad& corners) {
  const double stretch = std::hypot(fit.state.x[kStretch], fit.state.x[kStretch + 1]);
  const double blur_px = std::exp(fit.state.x[kLogBlur]) * (1 + 0.5 * stretch);
  const double cell_px = smallest_cell_px(corners, fit.pattern.cells);
  PixelLimits limits;
  limits.straightening = fit.straightening;
  limits.blur_cells = blur_px / cell_px;
  limits.outside_cells = std::clamp(std::max(2.5, 3.5 * blur_px) / cell_px, 0.3, 0.9);
  return limits;
}

/// How far each patch moves by a lens that is not quite the camera's (a tenth of its distortion), or by one
/// that is not known; the corners stay.
void expect_bends(const ImageView& image, const RefinementOptions& options, const Quad& corners,
                  TagFit& fit) {
  constexpr double kDoubtInDistortion = 0.1;
  const Vector2d image_px(image.width, image.height);
  const auto shift = [&](const Vector2d& px) -> Vector2d {
    if (fit.straightening.moves()) return kDoubtInDistortion * fit.straightening.shift(px);
    return unknown_lens_shift(image_px, options.curvature_per_px, px);
  };
  const Eigen::Matrix3d tag_H_x = homography_of(fit.state.x).inverse();
  std::array<Vector2d, 4> at_corners;
  for (std::size_t k = 0; k < 4; ++k) at_corners[k] = shift(corners[k]);
  for (int p = 0; p < fit.pixels.patches; ++p) {
    Patch& patch = fit.pixels.patch[static_cast<std::size_t>(p)];
    const Vector2d t = (tag_H_x * Eigen::Vector3d(patch.x, patch.y, 1)).hnormalized();
    const double right = 0.5 * (1 + t.x());
    const double low = 0.5 * (1 + t.y());
    const Vector2d px = fit.pixels.middle_px + fit.pixels.unit_px * Vector2d(patch.x, patch.y);
    patch.bend = (shift(px) - (1 - low) * ((1 - right) * at_corners[0] + right * at_corners[1]) -
                  low * ((1 - right) * at_corners[3] + right * at_corners[2])) /
                 fit.pixels.unit_px;
  }
}

/// Mean squared residual of a patch [grey level^2], nothing where all of it is saturated.
std::optional<double> misfit(const PatchSums& sums) {
  if (sums.pixels < 2) return std::nullopt;
  return static_cast<double>(sums.cost) / static_cast<double>(sums.pixels);
}

/// Patches whose residual is out of proportion to that of most others count less, or not at all: something
/// covers or lights the tag there. Returns the share of the pixels that is left.
double weigh_patches(bool measuring, TagFit& fit) {
  std::array<double, TagPixels::kMostPatches> misfits{};
  std::size_t known = 0;
  const auto count = static_cast<std::size_t>(fit.pixels.patches);
  for (std::size_t p = 0; p < count; ++p) {
    if (const auto of = misfit(fit.state.sums[p])) misfits[known++] = *of;
  }
  if (known == 0) return 0;
  const auto middle = misfits.begin() + static_cast<std::ptrdiff_t>(known / 2);
  std::nth_element(misfits.begin(), middle, misfits.begin() + static_cast<std::ptrdiff_t>(known));
  const double usual = (measuring ? 6.0 : 20.0) * (*middle + 0.25);
  constexpr double kOutOfProportion = 6.0;
  double pixels = 0;
  double left = 0;
  for (std::size_t p = 0; p < count; ++p) {
    const double of = misfit(fit.state.sums[p]).value_or(0);
    double& weight = fit.pixels.patch[p].weight;
    weight = of <= usual ? 1 : of > kOutOfProportion * usual ? 0 : usual / of;
    pixels += static_cast<double>(fit.state.sums[p].pixels);
    left += weight * static_cast<double>(fit.state.sums[p].pixels);
  }
  return left / std::max(1.0, pixels);
}

/// The covariance is wider by how much more the patches pull than independent noise of their pixels would
/// have them (Huber, "The behavior of maximum likelihood estimates under nonstandard conditions", Berkeley
/// Symposium 1967; here as one factor).
double excess_of_patches(const TagFit& fit) {
  double pulls = 0;
  for (int p = 0; p < fit.pixels.patches; ++p) {
    const TagVector& g = fit.state.patch_gradient[static_cast<std::size_t>(p)];
    pulls += g.dot(fit.covariance * g);
  }
  pulls /= fit.state.noise_variance * fit.state.noise_variance;
  return pulls / (fit.covariance.cwiseProduct(fit.information).sum() / fit.state.noise_variance);
}

/// The normal equations at the current estimate, in units of the noise that the residuals show.
void normal_equations(bool anew, TagFit& fit, TagMatrix& information, TagVector& gradient) {
  const TagEquations equations = equations_of(fit.pattern, fit.pixels, anew, fit.state);
  if (anew) fit.information = equations.information;
  constexpr double kQuantisation = 1.0 / 12.0;
  fit.state.noise_variance = std::max(
      kQuantisation, equations.cost / std::max(1.0, equations.pixels - static_cast<double>(kTagParameters)));
  information = fit.information / fit.state.noise_variance;
  gradient = equations.gradient / fit.state.noise_variance;
  constexpr double kFaintPx = 3;  // a tag of which nothing is seen stays where it is
  information.diagonal().head<8>().array() += std::pow(fit.pixels.unit_px / kFaintPx, 2);
  add_priors(fit.priors, fit.state.x, information, gradient);
}

/// Moves the estimate, not further than the model is near linear; the largest displacement of a corner [px].
double move(const TagVector& step, TagFit& fit) {
  TagVector& x = fit.state.x;
  const double moved = (corners_by_homography(x) * step.head<8>()).cwiseAbs().maxCoeff() * fit.pixels.unit_px;
  constexpr double kLongestPx = 1.0;
  constexpr double kLargestLogBlur = 0.5;
  constexpr double kLargestGrowth = 1.0;
  const auto within = [](double value, double limit) { return limit / std::max(std::abs(value), limit); };
  x += std::min({within(moved, kLongestPx), within(step[kLogBlur], kLargestLogBlur),
                 within(step[kTagGrowth], kLargestGrowth)}) *
       step;
  // Narrower than a pixel's own box or wider than the tag means lost; stay where the model makes sense.
  x[kLogBlur] = std::clamp(x[kLogBlur], std::log(0.25), std::log(4.0));
  x[kTagGrowth] = std::clamp(x[kTagGrowth], -2.5, 2.5);
  constexpr double kMostStretch = 0.9;
  x.segment<2>(kStretch) *= within(x.segment<2>(kStretch).norm(), kMostStretch);
  return moved;
}

/// What the one parameter of a lens leaves of the bends it was fitted to.
double bend_error_px(const TagFit& fit) {
  constexpr double kShare = 0.25;
  double largest = 0;
  for (int p = 0; p < fit.pixels.patches; ++p) {
    largest = std::max(largest, fit.pixels.patch[static_cast<std::size_t>(p)].bend.norm());
  }
  return kShare * std::abs(fit.state.x[kLens]) * largest * fit.pixels.unit_px;
}

}  // namespace

Quad corners_of(const TagFit& fit) {
  const Eigen::Matrix3d H = homography_of(fit.state.x);
  Quad corners;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector3d p = H * Eigen::Vector3d(k == 1 || k == 2 ? 1 : -1, k >= 2 ? 1 : -1, 1);
    corners[k] = fit.straightening.distorted(fit.pixels.middle_px + fit.pixels.unit_px * p.head<2>() / p.z());
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
  fit.pattern = tag_pattern(detection.tag);
  if (camera != nullptr) {
    fit.straightening = Straightening::of(*camera, detection.corners_px).value_or(Straightening());
  }
  fit.priors.blur_px = options.blur_px;
  fit.state.x[kLogBlur] = std::log(options.blur_px);
  set_corners(detection.corners_px, fit);
}

bool read_tag(const ImageView& image, const RefinementOptions& options, const Quad& corners, TagFit& fit) {
  if (!read_pixels(image, fit.pattern, homography_of(fit.state.x), pixel_limits(fit, corners), fit.pixels)) {
    return false;
  }
  expect_bends(image, options, corners, fit);
  return true;
}

void start_levels(TagFit& fit) {
  fit.state.x.segment<6>(kBlackPlane).setZero();
  measure_patches(fit.pattern, fit.pixels, fit.state);
  Eigen::Matrix2d A = 1e-6 * Eigen::Matrix2d::Identity();
  Vector2d b(0, 0);
  for (int p = 0; p < fit.pixels.patches; ++p) {
    const PatchSums& sums = fit.state.sums[static_cast<std::size_t>(p)];
    const auto cross = static_cast<double>(sums.information[kBlack][kStep]);
    A(0, 0) += static_cast<double>(sums.information[kBlack][kBlack]);
    A(0, 1) += cross;
    A(1, 0) += cross;
    A(1, 1) += static_cast<double>(sums.information[kStep][kStep]);
    b += Vector2d(static_cast<double>(sums.gradient[kBlack]), static_cast<double>(sums.gradient[kStep]));
  }
  const Vector2d levels = A.inverse() * b;
  fit.state.x[kBlackPlane] = levels[0];
  fit.state.x[kStepPlane] = levels[1];
}

std::optional<double> iterate(bool measuring, TagFit& fit) {
  TagMatrix information;
  TagVector gradient;
  double moved = 0;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    measure_patches(fit.pattern, fit.pixels, fit.state);
    constexpr double kLeastShare = 0.7;
    if ((measuring || iteration > 0) && weigh_patches(measuring, fit) < kLeastShare) return std::nullopt;
    // Later steps are too small to change the derivatives.
    normal_equations(iteration == 0 || (measuring && iteration == 1), fit, information, gradient);
    const Eigen::LDLT<TagMatrix> solver(information);
    const TagVector step = solver.solve(gradient);
    if (!step.allFinite()) return std::nullopt;
    const bool last = iteration + 1 == kMaxIterations;
    moved = move(step, fit);
    if (moved > (measuring ? kSettledPx : kFoundPx) && !last) continue;
    if (measuring) {
      fit.covariance = solver.solve(TagMatrix::Identity());
      fit.covariance *= kShapeOfBlur * std::max(1.0, excess_of_patches(fit));
    }
    break;
  }
  return moved;
}

Matrix8 corner_covariance(const TagFit& fit, double model_error_px) {
  const Quad corners = corners_of(fit);
  // What the growth of white leaves moves all borders together; measured, as the other factor.
  constexpr double kCrowdedPx = 0.018;
  const double cell_px = smallest_cell_px(corners, fit.pattern.cells);
  const double growth_px = kCrowdedPx * std::exp(fit.state.x[kLogBlur]) / cell_px;
  const Vector2d middle = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  Eigen::Matrix<double, 8, 1> outwards;
  for (int k = 0; k < 4; ++k) {
    outwards.segment<2>(2 * k) =
        growth_px / fit.pixels.unit_px * (corners[static_cast<std::size_t>(k)] - middle);
  }
  Matrix8 J = corners_by_homography(fit.state.x) * fit.pixels.unit_px;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Matrix2d bent =
        fit.straightening.distorted_by_straight(corners[static_cast<std::size_t>(k)]);
    J.middleRows<2>(2 * k) = (bent * J.middleRows<2>(2 * k)).eval();
  }
  Matrix8 covariance = J * fit.covariance.topLeftCorner<8, 8>() * J.transpose();
  const double error_px = std::hypot(model_error_px, bend_error_px(fit));
  covariance.diagonal().array() += error_px * error_px;
  covariance += outwards * outwards.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace waymark::refinement
