#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include <Eigen/Core>

#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {

/// Thresholds and priors for the refinement. The defaults are calibrated: see
/// docs/concepts/corner_refinement.md.
struct RefinementOptions {
  double min_cell_px = 1.0;
  double max_shift_px = 1.5;
  double min_contrast = 10;
  double max_residual = 0.12;
  double blur_px = 0.65;
  double model_error_px = 0.001;
  double curvature_per_px = 4e-4;
  double unrefined_sigma_px = 0.5;
  double border_px = 3;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(
        self.min_cell_px,
        Field{
            "min_cell_px",
            "Minimum size of a cell of a tag [px] for refinement; smaller tags keep the detector's corners.",
            0.8, 100});
    visit(self.max_shift_px,
          Field{"max_shift_px", "Maximum shift of a border edge [px]; a fit that exceeds it is rejected.",
                0.1, 20});
    visit(self.min_contrast,
          Field{"min_contrast", "Minimum step from black to white [grey level] for refinement.", 1, 255});
    visit(self.max_residual,
          Field{"max_residual",
                "Maximum root mean square residual of an accepted fit, as a fraction of the step.", 0.01, 1});
    visit(self.blur_px, Field{"blur_px",
                              "Expected standard deviation of the image blur, pixel included [px]; used as a "
                              "prior for small tags.",
                              0.3, 4});
    visit(self.model_error_px,
          Field{"model_error_px",
                "Standard deviation [px] of model errors, added to the position of each edge.", 0, 1});
    visit(self.curvature_per_px, Field{"curvature_per_px",
                                       "Maximum curvature of edges if no camera model straightens them "
                                       "[1/px]; 0 for rectified images.",
                                       0, 0.01});
    visit(self.unrefined_sigma_px,
          Field{"unrefined_sigma_px",
                "Typical standard deviation [px] of corners that could not be refined; scales that of every "
                "cause.",
                0.01, 10});
    visit(self.border_px, Field{"border_px",
                                "Distance of a corner to the border of the image [px] below which the tag "
                                "may be cut: its corners are then placed by the cells inside.",
                                0, 100});
  }
};

/// The outcome of refining one tag.
enum class RefinementOutcome : std::uint8_t {
  Refined,        ///< the corners are those found by the fit
  UnusableQuad,   ///< the corners are not finite, convex, clockwise and inside the image, or the family does
                  ///< not have this id
  TooSmall,       ///< the cells are smaller than min_cell_px
  CutByBorder,    ///< a corner is at or beyond the image border, so part of the tag may be missing
  TooLittleSeen,  ///< too few pixels of an edge are visible
  LowContrast,    ///< there is no step between the border and its surroundings
  PoorFit,  ///< the residual exceeds max_residual, the fit did not converge, or the variance is larger than
            ///< without it
  MovedTooFar,  ///< an edge moved farther than max_shift_px
};

/// Name of an outcome: "refined", "too_small", …
[[nodiscard]] std::string_view to_string(RefinementOutcome outcome);

/// Corners with their covariance. Always usable: if the fit failed, these are the input corners, moved to the
/// steps between the cells of the tag where those are visible. Their covariance is then the one that the
/// cause implies (kept_corners.hpp).
struct RefinedCorners {
  RefinementOutcome outcome = RefinementOutcome::UnusableQuad;
  std::array<Eigen::Vector2d, 4> corners_px{};                 ///< TL, TR, BR, BL; pixel centres are at +1/2
  CornerCovariance covariance_px2 = CornerCovariance::Zero();  ///< for x0 y0 … x3 y3; positive definite
  double blur_px = 0;   ///< fitted standard deviation of the blur, including the pixel; 0 if not refined
  double contrast = 0;  ///< [grey level] fitted step from the border to its surroundings; negative if the
                        ///< border is the brighter side (reversed border or inverted print, but not both)
  double noise = 0;     ///< [grey level] root mean square of the residuals, used as the noise of the image
  int pixels = 0;       ///< number of pixels used
  /// The border contradicts the bits inside (because it is covered or glossy or has too narrow a white
  /// margin), so the corners were estimated from the bits alone.
  bool by_bits = false;
  /// A side of the border bulges by more than a pixel, because the sheet is bent or because the camera moved
  /// while a rolling shutter read the image. The corners are the intersections of the curves.
  bool curved = false;
  /// Unreliable if neither the border nor the bits determined the corners (they contradict each other, or the
  /// fit moved too far from every starting point). In addition, the steps between cells must contradict the
  /// kept corners beyond their covariance.
  CornerState state = CornerState::Measured;

  [[nodiscard]] bool refined() const { return outcome == RefinementOutcome::Refined; }
};

/// Fits the four border edges of a tag to the pixels of the original image and intersects them. Each edge is
/// modelled as a step with Gaussian blur, next to the bits that its family prints there. Positions, levels
/// and blur are fitted by Gauss-Newton iteration to all four edges at once. The covariance is that of the
/// least squares estimate, with the noise level given by the residuals, plus an allowance for model errors.
/// See docs/concepts/corner_refinement.md.
///
/// With `camera`, edges are expected to curve as straight lines do under its distortion; corners remain in
/// distorted pixels.
///
/// Pure and re-entrant; does not allocate. O(pixels along the border); takes tens of microseconds.
[[nodiscard]] RefinedCorners refine_corners(const ImageView& image, const TagDetection& detection,
                                            const RefinementOptions& options = {},
                                            const CameraModel* camera = nullptr);

}  // namespace waymark
