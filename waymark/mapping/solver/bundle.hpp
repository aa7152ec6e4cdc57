#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/factors/corner_factor.hpp"
#include "waymark/factors/odometry_factor.hpp"
#include "waymark/factors/pose_factors.hpp"
#include "waymark/geometry/se3.hpp"

/// A least-squares problem over poses represented as plain values, both unknowns and measurements. It can
/// describe a robot among tags on walls, several cameras on a rig, and fixed cameras that observe tags on
/// moving bodies.
namespace waymark {

namespace internal {
class BlockSystem;
class KeptFactor;
}  // namespace internal

/// Index into Bundle::poses.
using PoseIndex = std::size_t;

/// A pose. Its value is the starting point of the search and, afterwards, the result.
struct BundlePose {
  SE3 value{};
  bool fixed = false;  ///< whether the pose is held constant instead of being an unknown
};

/// The corners of a tag with cam_T_tag = (rig cam)^-1 body tag, given by the indices of these four poses.
struct CornerTerm {
  PoseIndex rig = 0, cam = 0, body = 0, tag = 0;
  std::size_t camera = 0;  ///< index into Bundle::cameras
  CornerFactor factor{};
  bool used = true;  ///< false for an outlier, which is evaluated but does not add to the cost
  /// No other observation confirms it; it is unused until all other poses are estimated.
  bool unconfirmed = false;
  std::optional<std::size_t> size{};  ///< index into Bundle::sizes; without it, the size of the tag is exact
};

/// The deviation of a printed size from the one given in CornerFactor: the side is exp(log_scale) times as
/// long.
struct BundleSize {
  double log_scale = 0;
  /// Standard deviation of the prior, whose mean is Bundle::common_size. If 0, the size has no deviation of
  /// its own.
  double sigma = 0;
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
  bool robust = false;  ///< whether the robust loss applies to it as to the corners
  bool used = true;     ///< false for an outlier, which does not add to the cost
};
/// Wheel odometry. `scales`: index into Bundle::odometry_scales.
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

/// A point on a tag, given by its body, the pose of the tag on the body, and the point in the tag's frame,
/// which Bundle::common_size scales.
struct BundlePoint {
  PoseIndex body = 0, tag = 0;
  Eigen::Vector3d tag_p = Eigen::Vector3d::Zero();
};
/// Distance between points on two tags that share no tag pose.
struct PointDistanceTerm {
  BundlePoint a{}, b{};
  double measured_m = 0, sigma_m = 0.01;
};
/// Coordinate of a point on a tag along a direction in the map (of unit length).
struct PointCoordinateTerm {
  BundlePoint point{};
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double measured_m = 0, sigma_m = 0.01;
};

/// An axis of a tag that is parallel or antiparallel to a direction in the map.
struct DirectionTerm {
  PoseIndex body = 0, tag = 0;
  DirectionFactor factor{};
};

struct BundleScales {
  OdometryScales value{};
  /// Standard deviations of the priors, whose means are 1, 1, 0, 0, …. Scales beyond the first two are
  /// unknowns only if all are positive.
  OdometryScales sigma{0.1, 0.3};
  bool fixed = false;

  [[nodiscard]] int unknowns() const { return sigma.vector().minCoeff() > 0 ? OdometryScales::kCount : 2; }
};

/// Parameters of a camera (see intrinsics_of) as unknowns with a prior.
struct BundleIntrinsics {
  Eigen::VectorXd prior{};
  Eigen::VectorXd sigma{};  ///< standard deviations of the prior; empty if the camera is fixed
  bool possible = true;     ///< false if a step led to invalid camera parameters

  [[nodiscard]] bool free() const { return sigma.size() > 0; }
};

struct Bundle {
  std::vector<CameraModel> cameras{};
  std::vector<BundleIntrinsics> intrinsics{};  ///< for each camera; empty if all are fixed
  std::vector<BundlePose> poses{};
  std::vector<BundleScales> odometry_scales{};
  std::vector<BundleSize> sizes{};
  /// The error that all `sizes` share, with a prior whose mean is 0. If its sigma is 0, there is none. Sizes
  /// without a sigma of their own are then equal to it.
  BundleSize common_size{};
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

/// The poses and the size of a corner term.
[[nodiscard]] CornerPoses poses_of(const Bundle& bundle, const CornerTerm& term);
/// The side of its tag [m].
[[nodiscard]] double side_m(const Bundle& bundle, const CornerTerm& term);
/// The point in the map.
[[nodiscard]] Eigen::Vector3d map_point(const Bundle& bundle, const BundlePoint& p);

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
  /// Half the sum of squared whitened residuals, with the robust loss if one is set.
  double initial_cost = 0;
  double final_cost = 0;
  int invisible = 0;     ///< corner terms that were excluded because they could not be evaluated at the start
  bool stopped = false;  ///< stopped by BundleProgress before the poses converged
  std::string why{};     ///< the reason as text if the result is not usable

  [[nodiscard]] bool usable() const { return why.empty() && !stopped; }
};

/// Called before each step with the number of steps so far and the cost. Returning false stops the search,
/// and the result is then not usable.
using BundleProgress = std::function<bool(int iteration, double cost)>;

/// Minimises the cost, starting from the current poses, by Levenberg-Marquardt (Triggs et al., "Bundle
/// Adjustment - A Modern Synthesis", 2000, sections 3 and 6: sparse Cholesky of the normal equations in a
/// fill-reducing order). Corner terms of tags behind the camera at the start are excluded (used = false).
/// Unknowns that no term determines stay near their starting values. Deterministic, single-threaded.
BundleSummary solve(Bundle& bundle, const BundleOptions& options = {}, const BundleProgress& progress = {});

/// Runs one of several searches over the same poses. `kept` contains a factor that later searches can reuse.
BundleSummary solve(Bundle& bundle, const BundleOptions& options, const BundleProgress& progress,
                    internal::KeptFactor& kept);

/// Half the sum of squares of all whitened residuals at the current poses, without a robust loss.
[[nodiscard]] double cost(const Bundle& bundle);

/// The squared whitened residual of each corner term (8 residuals each); infinite if the tag is not visible.
[[nodiscard]] std::vector<double> corner_chi2(const Bundle& bundle);

/// Covariance of the result, given as blocks of the inverse of the information matrix.
struct BundleCovariance {
  /// Covariance of each pose in its left tangent; zero for fixed poses. If the information matrix could not
  /// be factorised, the standard deviation is 1e3 in every direction.
  std::vector<Matrix6> poses{};
  std::vector<Matrix6> scales{};              ///< in the order of OdometryScales::vector(); zero if fixed
  std::vector<Eigen::MatrixXd> intrinsics{};  ///< for each camera; empty if fixed
  std::vector<double> sizes{};            ///< variance of each log_scale; zero if exact or in no term in use
  std::vector<double> size_deviations{};  ///< variance of each log_scale minus the common one
  double common_size = 0;                 ///< variance of the common one; zero like that of a size
  std::vector<std::size_t> undetermined{};  ///< indices of poses with an undetermined direction
  /// Cross-covariances of the requested pairs (rows: first pose, columns: second pose).
  std::vector<Matrix6> pairs{};
};

/// Marginal covariance of every unknown at the current poses, from the terms in use, without a robust loss.
/// Computes only selected entries of the inverse, using the recursion of Takahashi, Fagan and Chin
/// ("Formation of a sparse bus impedance matrix", 1973). Costs about as much as one more factorisation.
[[nodiscard]] BundleCovariance covariance(const Bundle& bundle,
                                          const std::vector<std::pair<PoseIndex, PoseIndex>>& pairs = {});

namespace internal {

/// Poses, scales, intrinsics and sizes of a bundle that are unknowns of the linear system, and their
/// positions in it.
struct Unknowns {
  std::vector<int> of_pose{};  ///< index of each pose's unknown; -1 if the pose is fixed or in no term
  std::vector<int> of_scales{};
  std::vector<int> of_intrinsics{};  ///< for each camera; empty if all are fixed
  std::vector<int> of_sizes{};       ///< that of the common size for a size without a deviation of its own
  int of_common_size = -1;
  std::vector<int> dimensions{};
  std::vector<std::pair<int, int>> couplings{};
};

[[nodiscard]] Unknowns unknowns_of(const Bundle& bundle);

/// Adds every term in use to the system; computes only the cost if `system` is nullptr. Applies the Cauchy
/// loss with scale robust_chi2 to the tags and to robust relative terms, as reweighted least squares. Returns
/// the cost, which is infinite if a tag of a corner term in use is not visible.
double accumulate(const Bundle& bundle, const Unknowns& unknowns, double robust_chi2, BlockSystem* system);

/// Applies a step of the system. Poses are multiplied by the exponential of the step on the left; for scales,
/// intrinsics and sizes, the step is added.
void apply(const Unknowns& unknowns, const BlockSystem& system, const Eigen::VectorXd& step, Bundle& bundle);

}  // namespace internal
}  // namespace waymark
