#pragma once

#include <array>

#include <Eigen/Core>

#include "waymark/tags/edge_band.hpp"
#include "waymark/tags/edge_sums.hpp"

namespace waymark::refinement {

inline constexpr int kOwn = 4;     ///< parameters an edge has to itself
inline constexpr int kCommon = 3;  ///< parameters the edges of a tag nearly share

using EdgeVector = Eigen::Matrix<double, kParameters, 1>;
using EdgeMatrix = Eigen::Matrix<double, kParameters, kParameters>;

/// Least squares around one parameter vector: sum of w (r - J dx)^2 with J the derivative of the model.
struct NormalEquations {
  EdgeMatrix information = EdgeMatrix::Zero();  ///< sum of w J^T J
  EdgeVector gradient = EdgeVector::Zero();     ///< sum of w J^T r
  double cost = 0;                              ///< sum of w r^2 [grey level^2]
  double flat_cost = 0;    ///< the part of cost from pixels that hardly change when the edge moves
  double flat_pixels = 0;  ///< the number of those pixels
  /// How much the flat pixels say about light that grows along the edge, t from -1 to 1 [grey level^2].
  double light_information = 0;  ///< sum of w (I t)^2 with I the model
  double light_gradient = 0;     ///< sum of w I t r

  [[nodiscard]] double pixels() const { return information(kInnerLevel, kInnerLevel); }  ///< that count
};

/// Sum of w r^2 of each slice, by blocks.
using SliceCosts = std::array<Lanes, kMaxBlocks>;

/// Compares a band with the model of a blurred edge and its surroundings,
///
///     I(d) = inner + step f(d) + beyond h(d),    z = (d - shift) / blur,    shift = own displacement at this
///     place f = 1 - inside Phi(-z) + behind Phi(-z - behind_px / blur) + beyond Phi(z - beyond_px / blur) h
///     = Phi(z - beyond_px / blur)              where what lies beyond is not printed with the tag, else 0
///
/// A pixel at the end of the scale counts only while the model stays within it: beyond, it says no more than
/// that (as in Tobin, "Estimation of relationships for limited dependent variables", Econometrica 26, 1958).
///
/// All of it in light that grows along the edge: grey levels are (1 + light t) times these, t from -1 to 1.
///
/// d is the signed distance from the edge, Phi the normal distribution function; behind, beyond, inside are
/// as in Band. O(pixels).
[[nodiscard]] NormalEquations linearize(const Band& band, const EdgeVector& parameters, double light,
                                        SliceCosts& costs, SumEdge sum_edge = quickest_sum_edge());

}  // namespace waymark::refinement
