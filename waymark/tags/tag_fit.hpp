#pragma once

#include <array>

#include <Eigen/Core>

#include "waymark/tags/edge_model.hpp"

namespace waymark::refinement {

/// What is assumed before looking: how far the edges of one tag may differ, and how far the blur may lie
/// from `blur_px`. Standard deviations.
struct Priors {
  double inner_level = 0.03;  ///< of an edge from the mean of the tag, share of the step
  double step = 0.05;         ///< of an edge from the mean of the tag, share of the step
  double log_blur = 0.1;      ///< of an edge from the mean of the tag
  double blur_px = 0.65;
  double mean_log_blur = 0.5;             ///< of the tag from ln(blur_px)
  double beyond = 1.0;                    ///< step beyond the ring outside, share of the step
  std::array<double, 4> bend_sigma_px{};  ///< kBend of each edge around 0; 0: known exactly
};

/// Current estimate of all four edges.
struct TagEstimate {
  std::array<EdgeVector, 4> edges;         ///< of TL-TR, TR-BR, BR-BL, BL-TL
  Eigen::Matrix<double, kCommon, 1> mean;  ///< means of kInnerLevel, kStep, kLogBlur
  double noise_variance = 25;              ///< [grey level^2]
  /// How the light falls off across the tag: grey levels are 1 + light_per_px . (px - middle) times those of
  /// even light. Estimated beside the rest, where the model is flat.
  Eigen::Vector2d light_per_px = Eigen::Vector2d::Zero();
};

/// Four edges solved together: what they nearly share is drawn towards a common mean (a hierarchical linear
/// model), so that short edges borrow levels and blur from long ones. The common part is eliminated edge by
/// edge, no matrix is larger than 4 x 4.
class TagSolve {
 public:
  TagSolve(const std::array<NormalEquations, 4>& normals, const Priors& priors, const TagEstimate& at);

  /// Moves the estimate by the Gauss-Newton step, shortened where it is wild; the largest displacement moved
  /// [px].
  double apply(TagEstimate& estimate) const;

  /// Covariance of (kFrom, kTo) of the four edges [px^2].
  [[nodiscard]] Eigen::Matrix<double, 8, 8> displacement_covariance() const;

 private:
  using Own = Eigen::Matrix<double, kOwn, 1>;
  using Common = Eigen::Matrix<double, kCommon, 1>;
  using OwnMatrix = Eigen::Matrix<double, kOwn, kOwn>;
  using CommonMatrix = Eigen::Matrix<double, kCommon, kCommon>;
  using Coupling = Eigen::Matrix<double, kOwn, kCommon>;

  struct Edge {
    OwnMatrix own_covariance;        ///< given the common parameters
    Coupling own_by_common;          ///< minus the change of own parameters with the common ones
    CommonMatrix common_covariance;  ///< given the mean
    Own own_step;                    ///< given no change of the common parameters
    Common common_step;
  };

  std::array<Edge, 4> edges_;
  Common tie_;  ///< precision of an edge's common parameters around the mean
  CommonMatrix mean_covariance_;
  Common mean_step_;
};

}  // namespace waymark::refinement
