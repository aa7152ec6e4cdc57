#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include "waymark/tags/refinement/edge_model.hpp"
#include "waymark/tags/refinement/lens_bends.hpp"

namespace waymark::refinement {

/// The four edges of one tag and the pixels around them. Takes about 250 kB and is intended for the stack; a
/// tag only touches the part that it needs.
struct TagBands {
  std::array<EdgeFrame, 4> edges;
  std::array<Band, 4> bands;
  std::array<SliceCosts, 4> costs;  ///< results of the last linearize() for each band
  std::array<NormalEquations, 4> normals;
  int pixels = 0;                   ///< total over all bands
  std::optional<LensField> lens{};  ///< field of a known lens between these edges
};

/// Reads the bands around `edges`. The first pass uses a wider band and fewer slices, because an approximate
/// position is enough for it. Returns false if an edge has too few pixels.
[[nodiscard]] bool read_bands(const ImageView& image, const std::array<Surroundings, 4>& near, double blur_px,
                              bool first_pass, TagBands& tag);

/// Median grey level of the innermost (or outermost) pixels in all slices.
[[nodiscard]] double level_at_rim(const TagBands& tag, bool outermost);

/// Linearises the model of each band at `edges`, with the illumination gradient `illumination_per_px`.
/// Returns the sum of weighted squared residuals.
double linearize_all(const std::array<EdgeVector, 4>& edges, const Eigen::Vector2d& illumination_per_px,
                     TagBands& tag);

/// The result of drop_outliers().
struct DroppedSlices {
  int pixels = 0;
  bool enough_left = true;
};

/// Gives weight 0 to slices whose residuals are far larger than those of most others, because the edge is
/// covered there. Uses `costs`.
[[nodiscard]] DroppedSlices drop_outliers(TagBands& tag);

/// With an illumination gradient across a tag, grey levels are 1 + per_px . (px - middle) times those under
/// even illumination. The last linearize_all() determines per_px from the slope of the residuals along each
/// edge, where the model is flat. Differences in level between the edges are not used, because each edge has
/// its own level parameters.
struct IlluminationInformation {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();  ///< inverse covariance of per_px, with the prior
  Eigen::Vector2d step_per_px{0, 0};  ///< from the linearisation point to the best estimate
};

/// If a tag has few flat pixels, its illumination remains nearly even. O(1).
[[nodiscard]] IlluminationInformation illumination_information(const TagBands& tag,
                                                               const Eigen::Vector2d& illumination_per_px,
                                                               double noise_variance);

/// Standard deviations of the priors: how far the edges of one tag may differ, and how far the blur may
/// differ from `blur_px`.
struct Priors {
  double inner_level = 0.03;  ///< of one edge about the mean of the tag, as a fraction of the step
  double step = 0.05;         ///< of one edge about the mean of the tag, as a fraction of the step
  double log_blur = 0.1;      ///< of one edge about the mean of the tag
  double blur_px = 0.65;
  double mean_log_blur = 0.5;             ///< for the tag's mean about ln(blur_px)
  double beyond = 1.0;                    ///< step beyond the outer ring, as a fraction of the step
  std::array<double, 4> bend_sigma_px{};  ///< for kBend of each edge about 0; if 0, it is known exactly
};

/// Current estimate for all four edges.
struct TagEstimate {
  std::array<EdgeVector, 4> edges;         ///< in the order TL-TR, TR-BR, BR-BL, BL-TL
  Eigen::Matrix<double, kCommon, 1> mean;  ///< means of kInnerLevel, kStep, kLogBlur
  double noise_variance = 25;              ///< [grey level^2]
  /// Illumination gradient across the tag: grey levels are 1 + illumination_per_px . (px - middle) times
  /// those under even illumination. It is estimated separately, from flat pixels.
  Eigen::Vector2d illumination_per_px = Eigen::Vector2d::Zero();
};

/// Joint solution for four edges: their nearly common parameters have a common mean (a hierarchical linear
/// model), so that short edges benefit from the levels and blur of long ones. The common part is eliminated
/// edge by edge; no matrix is larger than 4 x 4.
class TagSolve {
 public:
  TagSolve(const std::array<NormalEquations, 4>& normals, const Priors& priors, const TagEstimate& at);

  /// Applies the Gauss-Newton step, shortened if it is too large. Returns the largest displacement [px].
  double apply(TagEstimate& estimate) const;

  /// Covariance of (kFrom, kTo) for all four edges [px^2].
  [[nodiscard]] Eigen::Matrix<double, 8, 8> displacement_covariance() const;

 private:
  using Own = Eigen::Matrix<double, kOwn, 1>;
  using Common = Eigen::Matrix<double, kCommon, 1>;
  using OwnMatrix = Eigen::Matrix<double, kOwn, kOwn>;
  using CommonMatrix = Eigen::Matrix<double, kCommon, kCommon>;
  using Coupling = Eigen::Matrix<double, kOwn, kCommon>;

  struct Edge {
    OwnMatrix own_covariance;  ///< given the common parameters
    Coupling own_by_common;    ///< negative derivative of own parameters with respect to the common ones
    CommonMatrix common_covariance;  ///< given the mean
    Own own_step;                    ///< if the common parameters do not change
    Common common_step;
  };

  std::array<Edge, 4> edges_;
  Common tie_;  ///< precision of an edge's common parameters about their mean
  CommonMatrix mean_covariance_;
  Common mean_step_;
};

using Matrix8 = Eigen::Matrix<double, 8, 8>;

/// Approximate number of parameters for the four edges of a tag: 8 displacements, and as many levels and
/// blurs.
inline constexpr int kParametersOfTag = 16;

/// J_corners_displacements: derivative of the corners (x0 y0 ... x3 y3) with respect to (kFrom, kTo) of the
/// four edges. Each corner is the intersection of two edges.
[[nodiscard]] Matrix8 intersection(const std::array<EdgeFrame, 4>& edges);

/// Covariance of the corners [px^2], positive definite: that of the least squares estimate, with the noise
/// level given by the residuals, plus model errors. `model_error_px` is added to the position of each edge.
[[nodiscard]] Matrix8 corner_covariance(const TagSolve& solve, const TagEstimate& estimate,
                                        const TagBands& tag, double model_error_px);

}  // namespace waymark::refinement
