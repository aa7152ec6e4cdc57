#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/factors/corner_factor.hpp"
#include "waymark/factors/odometry_factor.hpp"
#include "waymark/factors/pose_factors.hpp"
#include "waymark/geometry/se3.hpp"

/// A least-squares problem over poses as plain values: what is unknown, what was measured. One language for a
/// robot among tags on walls, several cameras on a rig, and fixed cameras that watch tags on moving bodies.
namespace waymark {

namespace internal {
class BlockSystem;
class KeptFactor;
}  // namespace internal

/// Index into Bundle::poses.
using PoseIndex = std::size_t;

/// An unknown pose; its value is where the search starts, and afterwards where it ended.
struct BundlePose {
  SE3 value{};
  bool fixed = false;  ///< known exactly
};

/// Corners of a tag: cam_T_tag = (rig cam)^-1 body tag, of poses with these indices.
struct CornerTerm {
  PoseIndex rig = 0, cam = 0, body = 0, tag = 0;
  std::size_t camera = 0;  ///< index into Bundle::cameras
  CornerFactor factor{};
  bool used = true;       ///< false: an outlier, evaluated but without a say
  bool doubtful = false;  ///< no other observation confirms it: without a say until everything else stands
};

struct PriorTerm {
  PoseIndex pose = 0;
  PosePriorFactor factor{};
};
struct PairPriorTerm {
  PoseIndex a = 0, b = 0;
  PosePairPriorFactor factor{};
};
struct RelativeTerm {
  PoseIndex a = 0, b = 0;
  RelativePoseFactor factor{};
};
/// Wheel odometry; its scales are unknown number `scales` of Bundle::odometry_scales.
struct OdometryTerm {
  PoseIndex a = 0, b = 0;
  std::size_t scales = 0;
  OdometryFactor factor{};
};
struct OnFloorTerm {
  PoseIndex floor = 0, base = 0;
  OnFloorFactor factor{};
};
struct DistanceTerm {
  PoseIndex a = 0, b = 0;
  DistanceFactor factor{};
};
struct CoordinateTerm {
  PoseIndex pose = 0;
  CoordinateFactor factor{};
};

/// A point of a tag: its body, its place there, and the point in the tag's frame.
struct BundlePoint {
  PoseIndex body = 0, tag = 0;
  Eigen::Vector3d tag_p = Eigen::Vector3d::Zero();
};
/// The distance between two points of tags that share no pose.
struct PointDistanceTerm {
  BundlePoint a{}, b{};
  double measured_m = 0, sigma_m = 0.01;
};
/// Where a point of a tag lies along a direction (unit length) of the map.
struct PointCoordinateTerm {
  BundlePoint point{};
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double measured_m = 0, sigma_m = 0.01;
};

/// An axis of a tag that points along a direction of the map, or against it.
struct DirectionTerm {
  PoseIndex body = 0, tag = 0;
  DirectionFactor factor{};
};

struct BundleScales {
  OdometryScales value{};
  /// How far from 1, 1, 0, … they may be, beforehand; beyond the first two they are unknown when all are
  /// positive.
  OdometryScales sigma{0.1, 0.3};
  bool fixed = false;

  [[nodiscard]] int unknowns() const { return sigma.vector().minCoeff() > 0 ? OdometryScales::kCount : 2; }
};

/// The numbers of a camera (intrinsics_of) as unknowns near a prior.
struct BundleIntrinsics {
  Eigen::VectorXd prior{};
  Eigen::VectorXd sigma{};  ///< of the prior; empty: the camera is known exactly
  bool possible = true;     ///< false: a step led to numbers that no camera has

  [[nodiscard]] bool free() const { return sigma.size() > 0; }
};

struct Bundle {
  std::vector<CameraModel> cameras{};
  std::vector<BundleIntrinsics> intrinsics{};  ///< by camera; empty: all are known
  std::vector<BundlePose> poses{};
  std::vector<BundleScales> odometry_scales{};
  std::vector<CornerTerm> corners{};
  std::vector<PriorTerm> priors{};
  std::vector<PairPriorTerm> pair_priors{};
  std::vector<RelativeTerm> relatives{};
  std::vector<OdometryTerm> odometry{};
  std::vector<OnFloorTerm> on_floor{};
  std::vector<DistanceTerm> distances{};
  std::vector<CoordinateTerm> coordinates{};
  std::vector<PointDistanceTerm> point_distances{};
  std::vector<PointCoordinateTerm> point_coordinates{};
  std::vector<DirectionTerm> directions{};

  PoseIndex add(const SE3& value, bool fixed = false) {
    poses.push_back({value, fixed});
    return poses.size() - 1;
  }
};

struct BundleOptions {
  int max_iterations = 100;
  double relative_gain = 1e-9;
  double robust_chi2 = 0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.max_iterations,
          Field{"max_iterations", "Maximum number of Levenberg-Marquardt steps.", 1, 10000});
    visit(self.relative_gain,
          Field{"relative_gain", "Relative decrease of the cost below which the optimisation has converged.",
                0, 1});
    visit(self.robust_chi2, Field{"robust_chi2",
                                  "Squared normalised error of a tag (8 numbers) above which the Cauchy loss "
                                  "reduces its weight; 0: least squares.",
                                  0, 1e9});
  }
};

/// How the search ended.
struct BundleSummary {
  bool converged = false;
  int iterations = 0;
  double initial_cost = 0;  ///< half the sum of squared whitened residuals, robust where asked
  double final_cost = 0;
  int invisible = 0;     ///< corner terms that could not be evaluated at the start and were set aside
  bool stopped = false;  ///< BundleProgress asked for it: the poses stand somewhere on the way
  std::string why{};     ///< in words, when it is not usable

  [[nodiscard]] bool usable() const { return why.empty() && !stopped; }
};

/// Called before each step: how many there were, and the cost. Returning false ends the search where it is;
/// what it found is not usable.
using BundleProgress = std::function<bool(int iteration, double cost)>;

/// Minimises the cost from where the poses stand by Levenberg and Marquardt's method (Triggs et al., "Bundle
/// Adjustment - A Modern Synthesis", 2000, sections 3 and 6: sparse Cholesky of the normal equations in an
/// order that keeps them sparse). Corner terms that look behind a camera at the start are set aside (used =
/// false). Unknowns that nothing determines stay near where they are. Deterministic, one thread.
BundleSummary solve(Bundle& bundle, const BundleOptions& options = {}, const BundleProgress& progress = {});

/// As solve(), for one of several searches over the same poses.
BundleSummary solve(Bundle& bundle, const BundleOptions& options, const BundleProgress& progress,
                    internal::KeptFactor& kept);

/// Half the sum of squares of all whitened residuals where the poses stand, without any robust loss.
[[nodiscard]] double cost(const Bundle& bundle);

/// The squared whitened residual of each corner term, 8 numbers each; infinite where it cannot be seen.
[[nodiscard]] std::vector<double> corner_chi2(const Bundle& bundle);

/// What is known afterwards: the inverse of the information matrix, by blocks.
struct BundleCovariance {
  /// Of each pose in its left tangent; zero for fixed ones, a standard deviation of 1e3 in every direction
  /// where the information matrix could not be factorised.
  std::vector<Matrix6> poses{};
  std::vector<Matrix6> scales{};              ///< of OdometryScales::vector(); zero for what is known
  std::vector<Eigen::MatrixXd> intrinsics{};  ///< by camera; empty for those that are known
  std::vector<std::size_t> undetermined{};    ///< poses (by index) with a direction that nothing determines
  std::vector<Matrix6> pairs{};               ///< of the pairs asked for: rows first, columns second
};

/// The marginal covariance of every unknown where the poses stand, from the terms in use, without a robust
/// loss: selected entries of the inverse by the recursion of Takahashi, Fagan and Chin ("Formation of a
/// sparse bus impedance matrix", 1973), at the cost of about one more factorisation, never the whole inverse.
[[nodiscard]] BundleCovariance covariance(const Bundle& bundle,
                                          const std::vector<std::pair<PoseIndex, PoseIndex>>& pairs = {});

namespace internal {

/// Which poses and scales of a bundle are unknowns of the linear system, and where.
struct Unknowns {
  std::vector<int> of_pose{};  ///< number of the unknown; -1: fixed or in no term
  std::vector<int> of_scales{};
  std::vector<int> of_intrinsics{};  ///< by camera; empty when all are known
  std::vector<int> dimensions{};
  std::vector<std::pair<int, int>> couplings{};
};

[[nodiscard]] Unknowns unknowns_of(const Bundle& bundle);

/// Adds every term in use to the system (nullptr: only the cost). Cauchy's loss on tags from robust_chi2 on,
/// as reweighted least squares. The cost; infinite when a corner term in use cannot be seen.
double accumulate(const Bundle& bundle, const Unknowns& unknowns, double robust_chi2, BlockSystem* system);

/// Applies a step of the system: poses by exp on the left, scales and intrinsics by addition.
void apply(const Unknowns& unknowns, const BlockSystem& system, const Eigen::VectorXd& step, Bundle& bundle);

}  // namespace internal
}  // namespace waymark
