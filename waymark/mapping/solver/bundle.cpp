#include "waymark/mapping/solver/bundle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>

#include "waymark/camera/intrinsics.hpp"
#include "waymark/factors/corner_factor.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/solver/front_cholesky.hpp"
#include "waymark/mapping/solver/levenberg_marquardt.hpp"

namespace waymark::internal {
namespace {

using Part = BlockSystem::Part;

/// The point in the frame of its tag.
Eigen::Vector3d scaled_point(const Bundle& bundle, const BundlePoint& p) {
  return std::exp(bundle.common_size.log_scale) * p.tag_p;
}

/// Accumulates terms, with one overload for each kind of term.
class Accumulator {
 public:
  Accumulator(const Bundle& bundle, const Unknowns& unknowns, double robust_chi2, BlockSystem* system)
      : bundle_(bundle), unknowns_(unknowns), robust_chi2_(robust_chi2), system_(system) {}

  void operator()(const CornerTerm& term) {
    if (!term.used) return;
    const int lens = unknowns_.of_intrinsics.empty() ? -1 : unknowns_.of_intrinsics[term.camera];
    CornerJacobians J;
    J.wants_rig = at(term.rig) >= 0;
    J.wants_cam = at(term.cam) >= 0;
    // The Jacobian of the body is otherwise minus that of the rig.
    J.wants_body = at(term.body) >= 0 && (!J.wants_rig || lens >= 0);
    J.wants_tag = at(term.tag) >= 0;
    const int size = term.size ? unknowns_.of_sizes[*term.size] : -1;
    J.wants_size = size >= 0;
    const CornerPoses poses = poses_of(bundle_, term);
    const auto r = corner_residual(term.factor, bundle_.cameras[term.camera], poses, system_ ? &J : nullptr);
    if (!r) {
      cost_ = std::numeric_limits<double>::infinity();
      return;
    }
    const double chi2 = r->squaredNorm();
    const bool robust = robust_chi2_ > 0;
    cost_ += (robust ? robust_chi2_ * std::log1p(chi2 / robust_chi2_) : chi2) / 2;
    if (system_ == nullptr) return;
    const double weight = robust ? 1 / (1 + chi2 / robust_chi2_) : 1;
    if (lens >= 0) {
      const auto J_lens = corner_intrinsics_jacobian(term.factor, bundle_.cameras[term.camera], poses);
      if (!J_lens) return;  // cannot happen, because the residual could be evaluated
      system_->add(std::array<Part, 6>{{{at(term.rig), J.rig},
                                        {at(term.cam), J.cam},
                                        {at(term.body), J.body},
                                        {at(term.tag), J.tag},
                                        {lens, *J_lens},
                                        {size, J.size}}},
                   *r, weight);
      return;
    }
    system_->add_corners({at(term.rig), at(term.cam), at(term.body), at(term.tag)},
                         {&J.rig, &J.cam, &J.body, &J.tag}, *r, weight);
    if (size < 0) return;
    system_->add_corner_size({at(term.rig), at(term.cam), at(term.body), at(term.tag)},
                             {&J.rig, &J.cam, &J.body, &J.tag}, size, J.size, *r, weight);
  }

  void operator()(const PriorTerm& term) {
    Matrix6 J;
    const Vector6 r = pose_prior_residual(term.factor, pose(term.pose), &J);
    add(r, std::array<Part, 1>{{{at(term.pose), J}}});
  }

  void operator()(const PairPriorTerm& term) {
    Matrix6 J_a;
    Matrix6 J_b;
    const Vector6 r = pose_pair_prior_residual(term.factor, pose(term.a), pose(term.b), &J_a, &J_b);
    add(r, std::array<Part, 2>{{{at(term.a), J_a}, {at(term.b), J_b}}});
  }

  void operator()(const RelativeTerm& term) {
    if (!term.used) return;
    Matrix6 J_a;
    Matrix6 J_b;
    const Vector6 r = relative_pose_residual(term.factor, pose(term.a), pose(term.b), &J_a, &J_b);
    const std::array<Part, 2> parts{{{at(term.a), J_a}, {at(term.b), J_b}}};
    if (!term.robust || !(robust_chi2_ > 0)) return add(r, parts);
    const double ratio = r.squaredNorm() / robust_chi2_;
    cost_ += robust_chi2_ * std::log1p(ratio) / 2;
    if (system_ != nullptr) system_->add(parts, r, 1 / (1 + ratio));
  }

  void operator()(const OdometryTerm& term) {
    OdometryJacobians J;
    const OdometryScales& scales = bundle_.odometry_scales[term.scales].value;
    const Eigen::Vector3d r = odometry_residual(term.factor, scales, pose(term.a), pose(term.b), &J);
    const int n = bundle_.odometry_scales[term.scales].unknowns();
    add(r, std::array<Part, 3>{{{at(term.a), J.a},
                                {at(term.b), J.b},
                                {unknowns_.of_scales[term.scales], J.scales.leftCols(n)}}});
  }

  void operator()(const OnFloorTerm& term) {
    Matrix36 J_floor;
    Matrix36 J_base;
    const Eigen::Vector3d r =
        on_floor_residual(term.factor, pose(term.floor), pose(term.base), &J_floor, &J_base);
    add(r, std::array<Part, 2>{{{at(term.floor), J_floor}, {at(term.base), J_base}}});
  }

  void operator()(const DistanceTerm& term) {
    Eigen::Matrix<double, 1, 6> J_a;
    Eigen::Matrix<double, 1, 6> J_b;
    const Eigen::Matrix<double, 1, 1> r(
        distance_residual(term.factor, pose(term.a), pose(term.b), &J_a, &J_b));
    add(r, std::array<Part, 2>{{{at(term.a), columns(J_a)}, {at(term.b), columns(J_b)}}});
  }

  void operator()(const CoordinateTerm& term) {
    Eigen::Matrix<double, 1, 6> J;
    const Eigen::Matrix<double, 1, 1> r(coordinate_residual(term.factor, pose(term.pose), &J));
    add(r, std::array<Part, 1>{{{at(term.pose), columns(J)}}});
  }

  void operator()(const PointDistanceTerm& term) {
    const TagPoint a = point(term.a);
    const TagPoint b = point(term.b);
    Eigen::RowVector3d J;
    const Eigen::Matrix<double, 1, 1> r(
        point_distance_residual(term.measured_m, term.sigma_m, a.map_p, b.map_p, &J));
    // The Jacobian of a common body is the sum of both parts.
    const double same_body = term.a.body == term.b.body ? 1 : 0;
    const Row J_body_a = J * (a.J_p_body - same_body * b.J_p_body);
    const Row J_body_b = -J * b.J_p_body;
    const Row J_tag_a = J * a.J_p_tag;
    const Row J_tag_b = -J * b.J_p_tag;
    const Eigen::Matrix<double, 1, 1> J_size(J * (by_common_size(term.a) - by_common_size(term.b)));
    add(r, std::array<Part, 5>{{{at(term.a.body), columns(J_body_a)},
                                {same_body > 0 ? -1 : at(term.b.body), columns(J_body_b)},
                                {at(term.a.tag), columns(J_tag_a)},
                                {at(term.b.tag), columns(J_tag_b)},
                                {unknowns_.of_common_size, J_size}}});
  }

  void operator()(const PointCoordinateTerm& term) {
    const TagPoint p = point(term.point);
    const Row J_body = term.direction.transpose() * p.J_p_body / term.sigma_m;
    const Row J_tag = term.direction.transpose() * p.J_p_tag / term.sigma_m;
    const Eigen::Matrix<double, 1, 1> J_size(term.direction.dot(by_common_size(term.point)) / term.sigma_m);
    const Eigen::Matrix<double, 1, 1> r((term.direction.dot(p.map_p) - term.measured_m) / term.sigma_m);
    add(r, std::array<Part, 3>{{{at(term.point.body), columns(J_body)},
                                {at(term.point.tag), columns(J_tag)},
                                {unknowns_.of_common_size, J_size}}});
  }

  void operator()(const DirectionTerm& term) {
    Matrix26 J_body;
    Matrix26 J_tag;
    const auto r = direction_residual(term.factor, pose(term.body), pose(term.tag), &J_body, &J_tag);
    add(r, std::array<Part, 2>{{{at(term.body), J_body}, {at(term.tag), J_tag}}});
  }

  void prior_of_scales(std::size_t i) {
    const BundleScales& scales = bundle_.odometry_scales[i];
    if (unknowns_.of_scales[i] < 0) return;
    const int n = scales.unknowns();
    const OdometryScales::Vector inverse_sigma = scales.sigma.vector().cwiseInverse();
    const OdometryScales::Vector off = scales.value.vector() - OdometryScales().vector();
    const Eigen::MatrixXd J = inverse_sigma.head(n).asDiagonal();
    add(inverse_sigma.head(n).cwiseProduct(off.head(n)), std::array<Part, 1>{{{unknowns_.of_scales[i], J}}});
  }

  void prior_of_intrinsics(std::size_t camera) {
    const BundleIntrinsics& intrinsics = bundle_.intrinsics[camera];
    if (unknowns_.of_intrinsics[camera] < 0) return;
    if (!intrinsics.possible) cost_ = std::numeric_limits<double>::infinity();
    const Eigen::VectorXd off = intrinsics_of(bundle_.cameras[camera]) - intrinsics.prior;
    const Eigen::MatrixXd J = intrinsics.sigma.cwiseInverse().asDiagonal();
    add(Eigen::VectorXd(J * off), std::array<Part, 1>{{{unknowns_.of_intrinsics[camera], J}}});
  }

  void prior_of_size(std::size_t i) {
    const BundleSize& size = bundle_.sizes[i];
    if (unknowns_.of_sizes[i] < 0 || !(size.sigma > 0)) return;
    const Eigen::Matrix<double, 1, 1> J(1 / size.sigma);
    const Eigen::Matrix<double, 1, 1> J_common = -J;
    add(Eigen::Matrix<double, 1, 1>((size.log_scale - bundle_.common_size.log_scale) / size.sigma),
        std::array<Part, 2>{{{unknowns_.of_sizes[i], J}, {unknowns_.of_common_size, J_common}}});
  }

  void prior_of_common_size() {
    if (unknowns_.of_common_size < 0) return;
    const BundleSize& size = bundle_.common_size;
    const Eigen::Matrix<double, 1, 1> J(1 / size.sigma);
    add(Eigen::Matrix<double, 1, 1>(size.log_scale / size.sigma),
        std::array<Part, 1>{{{unknowns_.of_common_size, J}}});
  }

  [[nodiscard]] double cost() const { return cost_; }

 private:
  using Row = Eigen::Matrix<double, 1, 6>;

  [[nodiscard]] TagPoint point(const BundlePoint& p) const {
    return tag_point(pose(p.body), pose(p.tag), scaled_point(bundle_, p));
  }
  /// The derivative of the point in the map by the logarithm of the common size.
  [[nodiscard]] Eigen::Vector3d by_common_size(const BundlePoint& p) const {
    return pose(p.body).rotation() * (pose(p.tag).rotation() * scaled_point(bundle_, p));
  }
  [[nodiscard]] const SE3& pose(PoseIndex i) const { return bundle_.poses[i].value; }
  [[nodiscard]] int at(PoseIndex i) const { return unknowns_.of_pose[i]; }
  /// A row vector as a column-major matrix, as required by Part.
  static Eigen::Map<const Eigen::MatrixXd> columns(const Eigen::Matrix<double, 1, 6>& row) {
    return {row.data(), 1, 6};
  }

  template <class Residual, std::size_t N>
  void add(const Residual& r, const std::array<Part, N>& parts) {
    cost_ += r.squaredNorm() / 2;
    if (system_ != nullptr) system_->add(parts, r);
  }

  const Bundle& bundle_;
  const Unknowns& unknowns_;
  double robust_chi2_;
  BlockSystem* system_;
  double cost_ = 0;
};

/// Calls `visit` with the poses of every term in use.
template <class Visit>
void for_poses_of_terms(const Bundle& bundle, const Visit& visit) {
  for (const CornerTerm& t : bundle.corners) {
    if (t.used) visit(std::array{t.rig, t.cam, t.body, t.tag});
  }
  for (const PriorTerm& t : bundle.priors) visit(std::array{t.pose});
  for (const PairPriorTerm& t : bundle.pair_priors) visit(std::array{t.a, t.b});
  for (const RelativeTerm& t : bundle.relatives) {
    if (t.used) visit(std::array{t.a, t.b});
  }
  for (const OdometryTerm& t : bundle.odometry) visit(std::array{t.a, t.b});
  for (const OnFloorTerm& t : bundle.on_floor) visit(std::array{t.floor, t.base});
  for (const DistanceTerm& t : bundle.distances) visit(std::array{t.a, t.b});
  for (const CoordinateTerm& t : bundle.coordinates) visit(std::array{t.pose});
  for (const PointDistanceTerm& t : bundle.point_distances)
    visit(std::array{t.a.body, t.a.tag, t.b.body, t.b.tag});
  for (const PointCoordinateTerm& t : bundle.point_coordinates) visit(std::array{t.point.body, t.point.tag});
  for (const DirectionTerm& t : bundle.directions) visit(std::array{t.body, t.tag});
}

/// Adds the intrinsics of the free cameras that have terms in use.
void add_intrinsics(const Bundle& bundle, Unknowns& unknowns) {
  if (std::ranges::none_of(bundle.intrinsics, &BundleIntrinsics::free)) return;
  unknowns.of_intrinsics.assign(bundle.cameras.size(), -1);
  for (const CornerTerm& term : bundle.corners) {
    if (!term.used || !bundle.intrinsics[term.camera].free()) continue;
    int& lens = unknowns.of_intrinsics[term.camera];
    if (lens < 0) {
      lens = static_cast<int>(unknowns.dimensions.size());
      unknowns.dimensions.push_back(static_cast<int>(bundle.intrinsics[term.camera].sigma.size()));
    }
    for (PoseIndex pose : {term.rig, term.cam, term.body, term.tag}) {
      if (unknowns.of_pose[pose] >= 0) unknowns.couplings.emplace_back(unknowns.of_pose[pose], lens);
    }
  }
}

/// Adds the sizes that are not exact and have terms in use, and their common one.
void add_sizes(const Bundle& bundle, Unknowns& unknowns) {
  const auto add = [&] {
    unknowns.dimensions.push_back(1);
    return static_cast<int>(unknowns.dimensions.size()) - 1;
  };
  const bool has_common = bundle.common_size.sigma > 0;
  int& common = unknowns.of_common_size;
  unknowns.of_sizes.assign(bundle.sizes.size(), -1);
  for (const CornerTerm& term : bundle.corners) {
    const bool deviates = term.size && bundle.sizes[*term.size].sigma > 0;
    if (!term.used || !term.size || !(deviates || has_common)) continue;
    int& size = unknowns.of_sizes[*term.size];
    if (has_common && common < 0) common = add();
    if (size < 0) {
      size = deviates ? add() : common;
      if (deviates && has_common) unknowns.couplings.emplace_back(common, size);
    }
    for (PoseIndex pose : {term.rig, term.cam, term.body, term.tag}) {
      if (unknowns.of_pose[pose] >= 0) unknowns.couplings.emplace_back(unknowns.of_pose[pose], size);
    }
    const int lens = unknowns.of_intrinsics.empty() ? -1 : unknowns.of_intrinsics[term.camera];
    if (lens >= 0) unknowns.couplings.emplace_back(lens, size);
  }
  const auto couple_with_common = [&](const BundlePoint& p) {
    for (const PoseIndex pose : {p.body, p.tag}) {
      if (common >= 0 && unknowns.of_pose[pose] >= 0)
        unknowns.couplings.emplace_back(unknowns.of_pose[pose], common);
    }
  };
  for (const PointDistanceTerm& term : bundle.point_distances) {
    couple_with_common(term.a);
    couple_with_common(term.b);
  }
  for (const PointCoordinateTerm& term : bundle.point_coordinates) couple_with_common(term.point);
}

}  // namespace

Unknowns unknowns_of(const Bundle& bundle) {
  Unknowns unknowns;
  std::vector<char> in_a_term(bundle.poses.size(), 0);
  for_poses_of_terms(bundle, [&](const auto& poses) {
    for (PoseIndex i : poses) in_a_term[i] = 1;
  });
  unknowns.of_pose.assign(bundle.poses.size(), -1);
  for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
    if (bundle.poses[i].fixed || in_a_term[i] == 0) continue;
    unknowns.of_pose[i] = static_cast<int>(unknowns.dimensions.size());
    unknowns.dimensions.push_back(6);
  }
  for (const BundleScales& scales : bundle.odometry_scales) {
    unknowns.of_scales.push_back(scales.fixed ? -1 : static_cast<int>(unknowns.dimensions.size()));
    if (!scales.fixed) unknowns.dimensions.push_back(scales.unknowns());
  }
  add_intrinsics(bundle, unknowns);
  add_sizes(bundle, unknowns);
  for_poses_of_terms(bundle, [&](const auto& poses) {
    for (PoseIndex a : poses) {
      for (PoseIndex b : poses) {
        if (a < b && unknowns.of_pose[a] >= 0 && unknowns.of_pose[b] >= 0)
          unknowns.couplings.emplace_back(unknowns.of_pose[a], unknowns.of_pose[b]);
      }
    }
  });
  for (const OdometryTerm& term : bundle.odometry) {
    const int scales = unknowns.of_scales[term.scales];
    for (PoseIndex pose : {term.a, term.b}) {
      if (scales >= 0 && unknowns.of_pose[pose] >= 0)
        unknowns.couplings.emplace_back(unknowns.of_pose[pose], scales);
    }
  }
  return unknowns;
}

double accumulate(const Bundle& bundle, const Unknowns& unknowns, double robust_chi2, BlockSystem* system) {
  if (system != nullptr) system->clear();
  Accumulator sum(bundle, unknowns, robust_chi2, system);
  const auto all = [&sum](const auto&... kinds) { (std::ranges::for_each(kinds, std::ref(sum)), ...); };
  all(bundle.corners, bundle.priors, bundle.pair_priors, bundle.relatives, bundle.odometry, bundle.on_floor,
      bundle.distances, bundle.coordinates, bundle.point_distances, bundle.point_coordinates,
      bundle.directions);
  for (std::size_t i = 0; i < bundle.odometry_scales.size(); ++i) sum.prior_of_scales(i);
  for (std::size_t i = 0; i < unknowns.of_intrinsics.size(); ++i) sum.prior_of_intrinsics(i);
  for (std::size_t i = 0; i < unknowns.of_sizes.size(); ++i) sum.prior_of_size(i);
  sum.prior_of_common_size();
  return sum.cost();
}

void apply(const Unknowns& unknowns, const BlockSystem& system, const Eigen::VectorXd& step, Bundle& bundle) {
  for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
    const int unknown = unknowns.of_pose[i];
    if (unknown < 0) continue;
    bundle.poses[i].value = plus(Vector6(step.segment<6>(system.offset(unknown))), bundle.poses[i].value);
  }
  for (std::size_t i = 0; i < bundle.odometry_scales.size(); ++i) {
    const int unknown = unknowns.of_scales[i];
    if (unknown < 0) continue;
    OdometryScales& value = bundle.odometry_scales[i].value;
    OdometryScales::Vector moved = value.vector();
    const int n = bundle.odometry_scales[i].unknowns();
    moved.head(n) += step.segment(system.offset(unknown), n);
    value = OdometryScales::of(moved);
  }
  for (std::size_t i = 0; i < unknowns.of_intrinsics.size(); ++i) {
    const int unknown = unknowns.of_intrinsics[i];
    if (unknown < 0) continue;
    const Eigen::VectorXd change = step.segment(system.offset(unknown), system.dimension(unknown));
    CameraModel& camera = bundle.cameras[i];
    const auto moved = with_intrinsics(camera, intrinsics_of(camera) + change);
    bundle.intrinsics[i].possible = moved && (moved->reaches_an_edge() || !camera.reaches_an_edge());
    if (bundle.intrinsics[i].possible) camera = *moved;
  }
  const auto apply_to = [&](int unknown, double& log_scale) {
    constexpr double kMaxLogScale = 0.7;  // a factor of two
    if (unknown < 0) return;
    log_scale = std::clamp(log_scale + step[system.offset(unknown)], -kMaxLogScale, kMaxLogScale);
  };
  apply_to(unknowns.of_common_size, bundle.common_size.log_scale);
  for (std::size_t i = 0; i < unknowns.of_sizes.size(); ++i) {
    if (bundle.sizes[i].sigma > 0)
      apply_to(unknowns.of_sizes[i], bundle.sizes[i].log_scale);
    else if (unknowns.of_sizes[i] >= 0)
      bundle.sizes[i].log_scale = bundle.common_size.log_scale;
  }
}

}  // namespace waymark::internal

namespace waymark {

CornerPoses poses_of(const Bundle& bundle, const CornerTerm& term) {
  return {bundle.poses[term.rig].value, bundle.poses[term.cam].value, bundle.poses[term.body].value,
          bundle.poses[term.tag].value, term.size ? std::exp(bundle.sizes[*term.size].log_scale) : 1};
}

double side_m(const Bundle& bundle, const CornerTerm& term) {
  return term.factor.size_m * (term.size ? std::exp(bundle.sizes[*term.size].log_scale) : 1);
}

Eigen::Vector3d map_point(const Bundle& bundle, const BundlePoint& p) {
  return bundle.poses[p.body].value * (bundle.poses[p.tag].value * internal::scaled_point(bundle, p));
}

namespace {

using internal::BlockSystem;
using internal::Unknowns;

std::optional<double> chi2_of(const Bundle& bundle, const CornerTerm& term) {
  const auto r = corner_residual(term.factor, bundle.cameras[term.camera], poses_of(bundle, term));
  if (!r) return std::nullopt;
  return r->squaredNorm();
}

int disable_invisible(Bundle& bundle) {
  int invisible = 0;
  for (CornerTerm& term : bundle.corners) {
    if (!term.used || chi2_of(bundle, term)) continue;
    term.used = false;
    ++invisible;
  }
  return invisible;
}

/// Values that a step changes, saved so that they can be restored.
struct Values {
  std::vector<BundlePose> poses;
  std::vector<BundleScales> scales;
  std::vector<CameraModel> cameras;
  std::vector<BundleIntrinsics> intrinsics;
  std::vector<BundleSize> sizes;
  BundleSize common_size;
};

/// Adapts a bundle to levenberg_marquardt(). Contains the normal equations and their factorisation.
class BundleProblem {
 public:
  BundleProblem(Bundle& bundle, const Unknowns& unknowns, const BundleOptions& options,
                internal::KeptFactor& kept)
      : bundle_(bundle),
        unknowns_(unknowns),
        robust_chi2_(options.robust_chi2),
        relative_gain_(options.relative_gain),
        kept_(kept),
        system_(unknowns.dimensions, unknowns.couplings),
        fronts_(internal::front_plan(system_)),
        keeps_(internal::worth_keeping(fronts_, system_)),
        cholesky_(system_, fronts_) {}
  BundleProblem(const BundleProblem&) = delete;  // cannot be copied, because its parts refer to each other
  BundleProblem& operator=(const BundleProblem&) = delete;

  double linearize() { return cost_ = internal::accumulate(bundle_, unknowns_, robust_chi2_, &system_); }
  [[nodiscard]] double cost() const {
    return internal::accumulate(bundle_, unknowns_, robust_chi2_, nullptr);
  }
  [[nodiscard]] const Eigen::VectorXd& gradient() const { return system_.gradient(); }
  std::optional<Eigen::VectorXd> damped_step(double damping) {
    constexpr double kShare = 0.1;  // share of the gain at which the search ends
    return keeps_ ? kept_.step(system_, damping, kShare * relative_gain_ * cost_)
                  : internal::damped_step(cholesky_, system_, damping);
  }
  void retract(const Eigen::VectorXd& step) { internal::apply(unknowns_, system_, step, bundle_); }
  [[nodiscard]] Values values() const {
    return {bundle_.poses,      bundle_.odometry_scales, bundle_.cameras,
            bundle_.intrinsics, bundle_.sizes,           bundle_.common_size};
  }
  void restore(const Values& values) {
    bundle_.poses = values.poses;
    bundle_.odometry_scales = values.scales;
    bundle_.cameras = values.cameras;
    bundle_.intrinsics = values.intrinsics;
    bundle_.sizes = values.sizes;
    bundle_.common_size = values.common_size;
  }

 private:
  Bundle& bundle_;
  const Unknowns& unknowns_;
  double robust_chi2_;
  double relative_gain_;
  double cost_ = 0;
  internal::KeptFactor& kept_;
  BlockSystem system_;
  internal::FrontPlan fronts_;
  bool keeps_;
  internal::FrontCholesky cholesky_;
};

}  // namespace

BundleSummary solve(Bundle& bundle, const BundleOptions& options, const BundleProgress& progress) {
  internal::KeptFactor kept;
  return solve(bundle, options, progress, kept);
}

BundleSummary solve(Bundle& bundle, const BundleOptions& options, const BundleProgress& progress,
                    internal::KeptFactor& kept) {
  BundleSummary summary;
  const Unknowns unknowns = internal::unknowns_of(bundle);
  if (unknowns.dimensions.empty()) {
    summary.why = "the bundle has no unknowns or no measurements";
    return summary;
  }
  BundleProblem problem(bundle, unknowns, options, kept);
  summary.initial_cost = problem.linearize();
  if (const int invisible = std::isfinite(summary.initial_cost) ? 0 : disable_invisible(bundle);
      invisible > 0) {
    summary = solve(bundle, options, progress, kept);
    summary.invisible += invisible;
    return summary;
  }
  const auto goes_on = [&](int iteration, double cost) { return !progress || progress(iteration, cost); };
  const auto end = internal::levenberg_marquardt(
      problem, summary.initial_cost,
      {.max_iterations = options.max_iterations, .relative_gain = options.relative_gain, .watchdog = true},
      goes_on);
  summary.converged = end.converged;
  summary.stopped = end.stopped;
  summary.iterations = end.iterations;
  summary.final_cost = end.cost;
  if (!std::isfinite(end.cost))
    summary.why = "the cost is not finite: a measurement or an initial pose is not finite";
  return summary;
}

double cost(const Bundle& bundle) {
  const Unknowns unknowns = internal::unknowns_of(bundle);
  return internal::accumulate(bundle, unknowns, 0, nullptr);
}

std::vector<double> corner_chi2(const Bundle& bundle) {
  std::vector<double> chi2;
  chi2.reserve(bundle.corners.size());
  for (const CornerTerm& term : bundle.corners)
    chi2.push_back(chi2_of(bundle, term).value_or(std::numeric_limits<double>::infinity()));
  return chi2;
}

BundleCovariance covariance(const Bundle& bundle, const std::vector<std::pair<PoseIndex, PoseIndex>>& pairs) {
  using internal::BlockSystem;
  BundleCovariance result;
  result.poses.assign(bundle.poses.size(), Matrix6::Zero());
  result.scales.assign(bundle.odometry_scales.size(), Matrix6::Zero());
  result.intrinsics.resize(bundle.cameras.size());
  result.sizes.assign(bundle.sizes.size(), 0);
  result.size_deviations = result.sizes;
  internal::Unknowns unknowns = internal::unknowns_of(bundle);
  if (unknowns.dimensions.empty()) return result;
  result.pairs.assign(pairs.size(), Matrix6::Zero());
  std::vector<std::pair<int, int>> wanted;
  wanted.reserve(pairs.size());
  for (const auto& [a, b] : pairs) wanted.emplace_back(unknowns.of_pose[a], unknowns.of_pose[b]);
  for (const int size : unknowns.of_sizes) wanted.emplace_back(size, unknowns.of_common_size);
  const auto both = [](const std::pair<int, int>& pair) { return pair.first >= 0 && pair.second >= 0; };
  std::ranges::copy_if(wanted, std::back_inserter(unknowns.couplings), both);
  BlockSystem system(unknowns.dimensions, unknowns.couplings);
  internal::accumulate(bundle, unknowns, 0, &system);
  // An undetermined direction is given a standard deviation of 1e3 m or rad instead of an infinite one.
  constexpr double kFloor = 1e-6;
  constexpr double kUndetermined = 1e3;
  const auto read = [&](const auto& block_of) {
    for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
      const int unknown = unknowns.of_pose[i];
      if (unknown < 0) continue;
      result.poses[i] = block_of(unknown);
      if (!(result.poses[i].diagonal().maxCoeff() <= kUndetermined)) result.undetermined.push_back(i);
    }
    for (std::size_t i = 0; i < bundle.odometry_scales.size(); ++i) {
      const int unknown = unknowns.of_scales[i];
      const int n = bundle.odometry_scales[i].unknowns();
      if (unknown >= 0) result.scales[i].topLeftCorner(n, n) = block_of(unknown);
    }
    for (std::size_t i = 0; i < unknowns.of_intrinsics.size(); ++i) {
      if (unknowns.of_intrinsics[i] >= 0) result.intrinsics[i] = block_of(unknowns.of_intrinsics[i]);
    }
    for (std::size_t i = 0; i < unknowns.of_sizes.size(); ++i) {
      if (unknowns.of_sizes[i] >= 0) result.sizes[i] = block_of(unknowns.of_sizes[i])(0, 0);
    }
    if (unknowns.of_common_size >= 0) result.common_size = block_of(unknowns.of_common_size)(0, 0);
    result.size_deviations = result.sizes;
  };
  const internal::FrontPlan fronts = internal::front_plan(system);
  internal::FrontCholesky cholesky(system, fronts);
  if (!cholesky.factorize(0, kFloor)) {
    // The covariance is unknown; zeros would mean that the poses are exact.
    read([&](int unknown) {
      const int n = system.dimension(unknown);
      return Eigen::MatrixXd(kUndetermined * kUndetermined * Eigen::MatrixXd::Identity(n, n));
    });
    result.undetermined.clear();
    for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
      if (unknowns.of_pose[i] >= 0) result.undetermined.push_back(i);
    }
    return result;
  }
  std::vector<std::pair<int, int>> asked;  // the diagonal blocks, followed by the wanted ones
  asked.reserve(static_cast<std::size_t>(system.unknowns()));
  for (int u = 0; u < system.unknowns(); ++u) asked.emplace_back(u, u);
  std::vector<Eigen::MatrixXd> blocks(asked.size());
  std::vector<std::size_t> wanted_of;  // of each block after those on the diagonal
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!both(wanted[i])) continue;
    asked.push_back(wanted[i]);
    wanted_of.push_back(i);
  }
  std::vector<std::pair<std::size_t, double>> with_common;  // covariances of sizes with the common size
  cholesky.visit_inverse_blocks(asked, [&](std::size_t i, const auto& block) {
    if (i < blocks.size()) {
      blocks[i] = block;
      return;
    }
    const std::size_t of = wanted_of[i - blocks.size()];
    if (of < pairs.size())
      result.pairs[of] = block;
    else
      with_common.emplace_back(of - pairs.size(), block(0, 0));
  });
  read([&](int unknown) -> const Eigen::MatrixXd& { return blocks[static_cast<std::size_t>(unknown)]; });
  for (const auto& [size, cross] : with_common)
    result.size_deviations[size] += result.common_size - 2 * cross;
  return result;
}

}  // namespace waymark
