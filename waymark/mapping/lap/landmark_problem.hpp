#pragma once

#include <utility>
#include <vector>

#include "waymark/factors/planar_factors.hpp"
#include "waymark/mapping/lap/landmark_map.hpp"
#include "waymark/mapping/solver/block_system.hpp"

/// The least-squares problem of landmark_map: plane poses, points, scales of odometry, mounting.
namespace waymark::internal {

struct PointObservation {
  std::size_t frame = 0, point = 0;
  PlanarPointFactor factor{};
  bool used = true;
};

struct PlaneMotion {
  std::size_t to = 0;  ///< from the frame before
  PlanarMotionFactor factor{};
};

/// Frame 0 is fixed. Unknowns in the order of the system: frames from 1 (x, y, yaw), points (x, y), scales
/// (distance, yaw), mounting (x, y, yaw); steps are additions.
struct LandmarkProblem {
  std::vector<Eigen::Vector3d> frames{};
  std::vector<Eigen::Vector2d> points{};
  Eigen::Vector2d scales = Eigen::Vector2d::Ones();
  Eigen::Vector3d mounting = Eigen::Vector3d::Zero();
  std::vector<PointObservation> observations{};
  std::vector<PlaneMotion> motions{};
  Eigen::Vector2d scales_sigma = Eigen::Vector2d::Ones();
  Eigen::Vector3d mounting_sigma = Eigen::Vector3d::Ones();

  [[nodiscard]] int of_frame(std::size_t i) const { return static_cast<int>(i) - 1; }
  [[nodiscard]] int of_point(std::size_t i) const { return static_cast<int>(frames.size() - 1 + i); }
  [[nodiscard]] int of_scales() const { return static_cast<int>(frames.size() - 1 + points.size()); }
  [[nodiscard]] int of_mounting() const { return of_scales() + 1; }
};

[[nodiscard]] BlockSystem system_of(const LandmarkProblem& problem);
/// Whitened.
[[nodiscard]] Eigen::Vector2d observation_residual(const LandmarkProblem& problem,
                                                   const PointObservation& seen);
/// Adds all terms (nullptr: only the cost), with Cauchy's loss on observations from robust_chi2 on (0: none).
double accumulate(const LandmarkProblem& problem, double robust_chi2, BlockSystem* system);
/// Levenberg and Marquardt's method; steps taken, and whether it converged.
std::pair<int, bool> solve(LandmarkProblem& problem, double robust_chi2, int max_iterations);

}  // namespace waymark::internal
