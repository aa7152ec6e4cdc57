#include "waymark/mapping/lap/landmark_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "waymark/base/order_statistics.hpp"
#include "waymark/mapping/lap/motion_tracks.hpp"
#include "waymark/mapping/solver/front_cholesky.hpp"
#include "waymark/mapping/solver/levenberg_marquardt.hpp"

namespace waymark {
namespace {

using internal::LandmarkProblem;
using internal::PointObservation;

/// The key frames with their base poses in odometry and their observations.
struct KeyFrames {
  std::vector<std::size_t> index{};
  std::vector<SE2> odom_X_base{};
};

KeyFrames key_frames(const std::vector<PointFrame>& frames, const std::vector<Odometry>& odometry,
                     const LandmarkMapOptions& options) {
  const OdometryTrack track(odometry);
  KeyFrames keys;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (i > 0 && frames[i].stamp <= frames[keys.index.empty() ? 0 : keys.index.back()].stamp) continue;
    const auto at = track.at(frames[i].stamp);
    if (!at) continue;
    if (!keys.index.empty()) {
      const SE2 gone = keys.odom_X_base.back().inverse() * *at;
      if (gone.translation().norm() < options.key_m && std::abs(gone.yaw()) < options.key_rad) continue;
    }
    keys.index.push_back(i);
    keys.odom_X_base.push_back(*at);
  }
  return keys;
}

/// The whitening for isotropic noise of an observed point.
Eigen::Matrix2d sight_whitening(const Eigen::Vector2d& base_p, const LandmarkMapOptions& options) {
  const double sigma = options.sight_sigma_m + options.sight_sigma_per_m * base_p.norm();
  return Eigen::Matrix2d::Identity() / sigma;
}

void add_motions(const KeyFrames& keys, const LandmarkMapOptions& options, LandmarkProblem& problem) {
  constexpr double kMinMotion_m = 0.001;
  constexpr double kMinMotion_rad = 0.002;
  double yaw = 0;
  problem.frames.emplace_back(Eigen::Vector3d::Zero());
  const SE2 map_X_odom = keys.odom_X_base.front().inverse();
  for (std::size_t i = 1; i < keys.index.size(); ++i) {
    const SE2 motion = keys.odom_X_base[i - 1].inverse() * keys.odom_X_base[i];
    const SE2 here = map_X_odom * keys.odom_X_base[i];
    yaw += motion.yaw();
    problem.frames.emplace_back(here.x(), here.y(), yaw);
    const double sigma_m =
        std::hypot(kMinMotion_m, options.way_sigma_m_per_sqrt_m * std::sqrt(motion.translation().norm()));
    const double sigma_rad =
        std::hypot(kMinMotion_rad, options.turn_sigma_rad_per_sqrt_rad * std::sqrt(std::abs(motion.yaw())));
    problem.motions.push_back({i, {motion.log(), {1 / sigma_m, 1 / sigma_m, 1 / sigma_rad}}});
  }
}

/// Initial positions of points: the medians of their positions according to odometry.
std::vector<TagId> add_points(const std::vector<PointFrame>& frames, const KeyFrames& keys,
                              const LandmarkMapOptions& options, LandmarkProblem& problem,
                              std::vector<TagId>& rarely_observed) {
  std::map<TagId, std::vector<PointObservation>> by_tag;
  for (std::size_t k = 0; k < keys.index.size(); ++k) {
    for (const SeenPoint& seen : frames[keys.index[k]].points) {
      if (seen.base_p.allFinite())
        by_tag[seen.tag].push_back({k, 0, {seen.base_p, sight_whitening(seen.base_p, options)}});
    }
  }
  std::vector<TagId> ids;
  for (auto& [tag, observations] : by_tag) {
    if (std::ssize(observations) < options.least_observations) {
      rarely_observed.push_back(tag);
      continue;
    }
    std::vector<double> x;
    std::vector<double> y;
    for (PointObservation& seen : observations) {
      seen.point = ids.size();
      const Eigen::Vector3d& at = problem.frames[seen.frame];
      const Eigen::Vector2d map_p = SE2(at.x(), at.y(), at.z()) * seen.factor.base_p;
      x.push_back(map_p.x());
      y.push_back(map_p.y());
      problem.observations.push_back(seen);
    }
    problem.points.emplace_back(median(x), median(y));
    ids.push_back(tag);
  }
  return ids;
}

/// Repeats noise estimation and outlier rejection until nothing changes.
void adjust_points_until_stable(LandmarkProblem& problem, LandmarkMap& map) {
  constexpr int kMaxSteps = 50;
  constexpr double kGate = 13.8;  // 0.999 quantile of chi-square with 2 degrees of freedom
  constexpr double kMedianChi2 = 1.386;
  const auto count = [&](std::pair<int, bool> end) {
    map.iterations += end.first;
    map.converged = end.second;
  };
  count(internal::solve(problem, 6, kMaxSteps));
  for (int round = 0; round < 4; ++round) {
    std::vector<double> chi2;
    chi2.reserve(problem.observations.size());
    for (const PointObservation& seen : problem.observations)
      chi2.push_back(internal::observation_residual(problem, seen).squaredNorm());
    const double ratio2 = std::max(median(chi2) / kMedianChi2, 1e-6);
    bool changed = false;
    for (std::size_t i = 0; i < chi2.size(); ++i) {
      PointObservation& seen = problem.observations[i];
      const bool used = chi2[i] / ratio2 < kGate;
      changed = changed || used != seen.used;
      seen.used = used;
      seen.factor.whitening /= std::sqrt(ratio2);
    }
    if (!changed && round > 0) return;
    count(internal::solve(problem, 0, kMaxSteps));
  }
}

Status read_covariance(const LandmarkProblem& problem, const std::vector<TagId>& ids, LandmarkMap& map) {
  internal::BlockSystem system = internal::system_of(problem);
  internal::accumulate(problem, 0, &system);
  const internal::FrontPlan plan = internal::front_plan(system);
  internal::FrontCholesky cholesky(system, plan);
  if (!cholesky.factorize(0, 1e-6))
    return fail(ErrorCode::InvalidArgument, "the observations do not determine the map");
  std::vector<std::pair<int, int>> diagonal;
  diagonal.reserve(static_cast<std::size_t>(system.unknowns()));
  for (int u = 0; u < system.unknowns(); ++u) diagonal.emplace_back(u, u);
  const std::vector<Eigen::MatrixXd> blocks = cholesky.inverse_blocks(diagonal);
  const auto block = [&](int unknown) -> const Eigen::MatrixXd& {
    return blocks[static_cast<std::size_t>(unknown)];
  };
  for (std::size_t i = 0; i < ids.size(); ++i) map.points[ids[i]].covariance = block(problem.of_point(i));
  for (std::size_t i = 0; i < problem.frames.size(); ++i) {
    const Eigen::Vector3d& x = problem.frames[i];
    map.map_X_base.emplace_back(x.x(), x.y(), x.z());
    const Eigen::Matrix3d P = i == 0 ? Eigen::Matrix3d::Zero() : Eigen::Matrix3d(block(problem.of_frame(i)));
    map.base_covariance.push_back(from_coordinate_covariance(map.map_X_base.back(), P).covariance);
  }
  const Eigen::MatrixXd& scales = block(problem.of_scales());
  const Eigen::MatrixXd& mounting = block(problem.of_mounting());
  map.scales_sigma = {std::sqrt(scales(0, 0)), std::sqrt(scales(1, 1))};
  map.mounting_sigma = mounting.diagonal().cwiseSqrt();
  return {};
}

void read_points(const LandmarkProblem& problem, const std::vector<TagId>& ids, LandmarkMap& map) {
  double squares = 0;
  int used = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) map.points[ids[i]].map_p = problem.points[i];
  for (const PointObservation& seen : problem.observations) {
    MappedPoint& point = map.points[ids[seen.point]];
    ++(seen.used ? point.observations : point.rejected);
    if (!seen.used) continue;
    squares +=
        (seen.factor.whitening.inverse() * internal::observation_residual(problem, seen)).squaredNorm();
    ++used;
  }
  map.rms_m = used > 0 ? std::sqrt(squares / used) : 0;
}

}  // namespace

Result<LandmarkMap> map_landmarks(const std::vector<PointFrame>& frames,
                                  const std::vector<Odometry>& odometry, const LandmarkMapOptions& options) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  const KeyFrames keys = key_frames(frames, odometry, options);
  if (keys.index.size() < 2)
    return fail(ErrorCode::NotFound,
                "no odometry at the times of the observations, or the robot did not move", {},
                "A map of points requires odometry. `waymark info` lists the contents of the recording.");
  LandmarkMap map{.frames = keys.index};
  LandmarkProblem problem;
  problem.scales_sigma = {options.distance_scale_sigma, options.yaw_scale_sigma};
  problem.mounting_sigma = {options.mounting_sigma_m, options.mounting_sigma_m, options.mounting_sigma_rad};
  add_motions(keys, options, problem);
  const std::vector<TagId> ids = add_points(frames, keys, options, problem, map.rarely_observed);
  if (ids.empty())
    return fail(
        ErrorCode::NotFound,
        fmt::format("no landmark was observed {} times while the robot moved", options.least_observations),
        {}, "Drive slowly past each tag.");
  adjust_points_until_stable(problem, map);
  read_points(problem, ids, map);
  if (Status status = read_covariance(problem, ids, map); !status) return tl::unexpected(status.error());
  map.scales = {problem.scales.x(), problem.scales.y()};
  map.base_X_assumed = SE2(problem.mounting.x(), problem.mounting.y(), problem.mounting.z());
  return map;
}

}  // namespace waymark

namespace waymark::internal {
namespace {

using Part = BlockSystem::Part;

double add_observation(const LandmarkProblem& p, const PointObservation& seen, double robust_chi2,
                       BlockSystem* system) {
  PlanarPointJacobians J;
  const Eigen::Vector2d r = planar_point_residual(seen.factor, p.frames[seen.frame], p.points[seen.point],
                                                  p.mounting, system != nullptr ? &J : nullptr);
  const double chi2 = r.squaredNorm();
  const bool robust = robust_chi2 > 0;
  if (system != nullptr) {
    system->add(std::array<Part, 3>{{{p.of_frame(seen.frame), J.base},
                                     {p.of_point(seen.point), J.point},
                                     {p.of_mounting(), J.mounting}}},
                r, robust ? 1 / (1 + chi2 / robust_chi2) : 1);
  }
  return (robust ? robust_chi2 * std::log1p(chi2 / robust_chi2) : chi2) / 2;
}

double add_motion(const LandmarkProblem& p, const PlaneMotion& motion, BlockSystem* system) {
  PlanarMotionJacobians J;
  const Eigen::Vector3d r =
      planar_motion_residual(motion.factor, p.frames[motion.to - 1], p.frames[motion.to], p.scales,
                             system != nullptr ? &J : nullptr);
  if (system != nullptr) {
    system->add(
        std::array<Part, 3>{
            {{p.of_frame(motion.to - 1), J.a}, {p.of_frame(motion.to), J.b}, {p.of_scales(), J.scales}}},
        r);
  }
  return r.squaredNorm() / 2;
}

double add_priors(const LandmarkProblem& p, BlockSystem* system) {
  const Eigen::Vector2d scales = (p.scales - Eigen::Vector2d::Ones()).cwiseQuotient(p.scales_sigma);
  const Eigen::Vector3d mounting = p.mounting.cwiseQuotient(p.mounting_sigma);
  if (system != nullptr) {
    const Eigen::MatrixXd J_scales = p.scales_sigma.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd J_mounting = p.mounting_sigma.cwiseInverse().asDiagonal();
    system->add(std::array<Part, 1>{{{p.of_scales(), J_scales}}}, scales);
    system->add(std::array<Part, 1>{{{p.of_mounting(), J_mounting}}}, mounting);
  }
  return (scales.squaredNorm() + mounting.squaredNorm()) / 2;
}

/// The values that a step changes.
struct Values {
  std::vector<Eigen::Vector3d> frames;
  std::vector<Eigen::Vector2d> points;
  Eigen::Vector2d scales;
  Eigen::Vector3d mounting;
};

class LandmarkSearch {
 public:
  LandmarkSearch(LandmarkProblem& problem, double robust_chi2)
      : problem_(problem),
        robust_chi2_(robust_chi2),
        system_(system_of(problem)),
        plan_(front_plan(system_)),
        cholesky_(system_, plan_) {}
  LandmarkSearch(const LandmarkSearch&) = delete;  // cannot be copied, because its parts refer to each other
  LandmarkSearch& operator=(const LandmarkSearch&) = delete;

  double linearize() { return accumulate(problem_, robust_chi2_, &system_); }
  [[nodiscard]] double cost() const { return accumulate(problem_, robust_chi2_, nullptr); }
  [[nodiscard]] const Eigen::VectorXd& gradient() const { return system_.gradient(); }
  std::optional<Eigen::VectorXd> damped_step(double damping) {
    return internal::damped_step(cholesky_, system_, damping);
  }
  void retract(const Eigen::VectorXd& step) {
    LandmarkProblem& p = problem_;
    for (std::size_t i = 1; i < p.frames.size(); ++i)
      p.frames[i] += step.segment<3>(system_.offset(p.of_frame(i)));
    for (std::size_t i = 0; i < p.points.size(); ++i)
      p.points[i] += step.segment<2>(system_.offset(p.of_point(i)));
    p.scales += step.segment<2>(system_.offset(p.of_scales()));
    p.mounting += step.segment<3>(system_.offset(p.of_mounting()));
  }
  [[nodiscard]] Values values() const {
    return {problem_.frames, problem_.points, problem_.scales, problem_.mounting};
  }
  void restore(const Values& values) {
    problem_.frames = values.frames;
    problem_.points = values.points;
    problem_.scales = values.scales;
    problem_.mounting = values.mounting;
  }

 private:
  LandmarkProblem& problem_;
  double robust_chi2_;
  BlockSystem system_;
  FrontPlan plan_;
  FrontCholesky cholesky_;
};

}  // namespace

Eigen::Vector2d observation_residual(const LandmarkProblem& p, const PointObservation& seen) {
  return planar_point_residual(seen.factor, p.frames[seen.frame], p.points[seen.point], p.mounting);
}

BlockSystem system_of(const LandmarkProblem& p) {
  std::vector<int> dimensions(p.frames.size() - 1, 3);
  dimensions.insert(dimensions.end(), p.points.size(), 2);
  dimensions.insert(dimensions.end(), {2, 3});
  std::vector<std::pair<int, int>> couplings;
  const auto couple = [&](int a, int b) {
    if (a >= 0 && b >= 0) couplings.emplace_back(a, b);
  };
  for (const PointObservation& seen : p.observations) {
    couple(p.of_frame(seen.frame), p.of_point(seen.point));
    couple(p.of_frame(seen.frame), p.of_mounting());
    couple(p.of_point(seen.point), p.of_mounting());
  }
  for (const PlaneMotion& motion : p.motions) {
    couple(p.of_frame(motion.to - 1), p.of_frame(motion.to));
    couple(p.of_frame(motion.to - 1), p.of_scales());
    couple(p.of_frame(motion.to), p.of_scales());
  }
  return {std::move(dimensions), std::move(couplings)};
}

double accumulate(const LandmarkProblem& problem, double robust_chi2, BlockSystem* system) {
  if (system != nullptr) system->clear();
  double cost = add_priors(problem, system);
  for (const PlaneMotion& motion : problem.motions) cost += add_motion(problem, motion, system);
  for (const PointObservation& seen : problem.observations) {
    if (seen.used) cost += add_observation(problem, seen, robust_chi2, system);
  }
  return cost;
}

std::pair<int, bool> solve(LandmarkProblem& problem, double robust_chi2, int max_iterations) {
  LandmarkSearch search(problem, robust_chi2);
  const auto end = levenberg_marquardt(search, search.linearize(),
                                       {.max_iterations = max_iterations, .relative_gain = 1e-8},
                                       [](int, double) { return true; });
  return {end.iterations, end.converged || end.exhausted};
}

}  // namespace waymark::internal
