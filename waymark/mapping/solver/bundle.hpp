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

/// A least-squares problem over poses as plain values: unknowns and measurements. It describes a robot among
/// tags on walls, several cameras on a rig, and fixed cameras that observe tags on moving bodies.
namespace waymark {

namespace internal {
class BlockSystem;
class KeptFactor;
}  // namespace internal

/// Index into Bundle::poses.
using PoseIndex = std::size_t;

/// A pose. Its value is the start of the search, and afterwards the result.
struct BundlePose {
  SE3 value{};
  bool fixed = false;  ///< not an unknown
};

/// Tag corners: cam_T_tag = (rig cam)^-1 body tag, with the indices of these poses.
struct CornerTerm {
  PoseIndex rig = 0, cam = 0, body = 0, tag = 0;
  std::size_t camera = 0;  ///< index into Bundle::cameras
  CornerFactor factor{};
  bool used = true;          ///< false: an outlier, which is evaluated but not in the cost
  bool unconfirmed = false;  ///< no other observation confirms it; unused until all other poses are estimated
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
/// Wheel odometry; `scales`: index into Bundle::odometry_scales.
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

/// A point of a tag: its body, the pose of the tag on the body, and the point in the tag's frame.
struct BundlePoint {
  PoseIndex body = 0, tag = 0;
  Eigen::Vector3d tag_p = Eigen::Vector3d::Zero();
};
/// Distance between points of two tags that share no pose.
struct PointDistanceTerm {
  BundlePoint a{}, b{};
  double measured_m = 0, sigma_m = 0.01;
};
/// Coordinate of a point of a tag along a direction (unit length) of the map.
struct PointCoordinateTerm {
  BundlePoint point{};
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double measured_m = 0, sigma_m = 0.01;
};

/// An axis of a tag that is parallel or antiparallel to a direction of the map.
struct DirectionTerm {
  PoseIndex body = 0, tag = 0;
  DirectionFactor factor{};
};

struct BundleScales {
  OdometryScales value{};
  /// Prior standard deviations around 1, 1, 0, …. Scales beyond the first two are unknowns only if all are
  /// positive.
  OdometryScales sigma{0.1, 0.3};
  bool fixed = false;

  [[nodiscard]] int unknowns() const { return sigma.vector().minCoeff() > 0 ? OdometryScales::kCount : 2; }
};

/// Parameters of a camera (intrinsics_of) as unknowns with a prior.
struct BundleIntrinsics {
  Eigen::VectorXd prior{};
  Eigen::VectorXd sigma{};  ///< of the prior; empty: the camera is fixed
  bool possible = true;     ///< false: a step led to invalid camera parameters

  [[nodiscard]] bool free() const { return sigma.size() > 0; }
};

struct Bundle {
  std::vector<CameraModel> cameras{};
  std::vector<BundleIntrinsics> intrinsics{};  ///< by camera; empty: all are fixed
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

/// Outcome of the search.
struct BundleSummary {
  bool converged = false;
  int iterations = 0;
  double initial_cost = 0;  ///< half the sum of squared whitened residuals, with the robust loss if set
  double final_cost = 0;
  int invisible = 0;     ///< corner terms that could not be evaluated at the start and were excluded
  bool stopped = false;  ///< by BundleProgress; the poses have not converged
  std::string why{};     ///< reason as text if not usable

  [[nodiscard]] bool usable() const { return why.empty() && !stopped; }
};

/// Called before each step with the number of steps so far and the cost. Return false to stop the search; the
/// result is then not usable.
using BundleProgress = std::function<bool(int iteration, double cost)>;

/// Minimises the cost from the current poses by Levenberg-Marquardt (Triggs et al., "Bundle Adjustment - A
/// Modern Synthesis", 2000, sections 3 and 6: sparse Cholesky of the normal equations in a fill-reducing
/// order). Corner terms of tags behind the camera at the start are excluded (used = false). Unknowns that no
/// term determines stay near their start. Deterministic, single-threaded.
BundleSummary solve(Bundle& bundle, const BundleOptions& options = {}, const BundleProgress& progress = {});

/// Runs one of several searches over the same poses. `kept` contains a factor that later searches reuse.
BundleSummary solve(Bundle& bundle, const BundleOptions& options, const BundleProgress& progress,
                    internal::KeptFactor& kept);

/// Half the sum of squares of all whitened residuals at the current poses, without a robust loss.
[[nodiscard]] double cost(const Bundle& bundle);

/// The squared whitened residual of each corner term (8 residuals each); infinite if the tag is not visible.
[[nodiscard]] std::vector<double> corner_chi2(const Bundle& bundle);

/// Covariance of the result: blocks of the inverse of the information matrix.
struct BundleCovariance {
  /// Of each pose in its left tangent; zero for fixed poses. A standard deviation of 1e3 in every direction
  /// if the information matrix could not be factorised.
  std::vector<Matrix6> poses{};
  std::vector<Matrix6> scales{};              ///< of OdometryScales::vector(); zero if fixed
  std::vector<Eigen::MatrixXd> intrinsics{};  ///< by camera; empty if fixed
  std::vector<std::size_t> undetermined{};    ///< poses (by index) with an undetermined direction
  std::vector<Matrix6> pairs{};               ///< of the requested pairs: rows first, columns second
};

/// Marginal covariance of every unknown at the current poses, from the terms in use, without a robust loss.
/// Computes only selected entries of the inverse, using the recursion of Takahashi, Fagan and Chin
/// ("Formation of a sparse bus impedance matrix", 1973). Costs about as much as one more factorisation.
[[nodiscard]] BundleCovariance covariance(const Bundle& bundle,
                                          const std::vector<std::pair<PoseIndex, PoseIndex>>& pairs = {});

namespace internal {

/// Poses, scales and intrinsics of a bundle that are unknowns of the linear system, and their positions in
/// it.
struct Unknowns {
  std::vector<int> of_pose{};  ///< number of the unknown; -1: fixed or in no term
  std::vector<int> of_scales{};
  std::vector<int> of_intrinsics{};  ///< by camera; empty if all are fixed
  std::vector<int> dimensions{};
  std::vector<std::pair<int, int>> couplings{};
};

[[nodiscard]] Unknowns unknowns_of(const Bundle& bundle);

/// Adds every term in use to the system (nullptr: computes only the cost). Applies the Cauchy loss to tags
/// from robust_chi2 on, as reweighted least squares. Returns the cost; infinite if a corner term in use is
/// not visible.
double accumulate(const Bundle& bundle, const Unknowns& unknowns, double robust_chi2, BlockSystem* system);

/// Applies a step of the system: poses by exp on the left, scales and intrinsics by addition.
void apply(const Unknowns& unknowns, const BlockSystem& system, const Eigen::VectorXd& step, Bundle& bundle);

}  // namespace internal
}  // namespace waymark
