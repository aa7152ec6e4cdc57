#include "waymark/mapping/lap/turn_noise.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

/// Way and turn of odometry up to a moment.
struct Driven {
  SensorTime stamp{};
  double way_m = 0;
  double turned_rad = 0;
};

double straight(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

std::vector<Driven> sums_of(const std::vector<Odometry>& odometry) {
  std::vector<Driven> sums;
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    Driven next{.stamp = odometry[i].stamp};
    if (i > 0) {
      const SE2 moved = odometry[i - 1].odom_T_base.inverse() * odometry[i].odom_T_base;
      next.way_m = sums.back().way_m + moved.translation().norm();
      next.turned_rad = sums.back().turned_rad + moved.yaw();
    }
    sums.push_back(next);
  }
  return sums;
}

std::optional<Driven> at(const std::vector<Driven>& sums, SensorTime stamp) {
  const auto after = std::ranges::lower_bound(sums, stamp, {}, &Driven::stamp);
  if (after == sums.begin() || after == sums.end()) return std::nullopt;
  const Driven& a = *std::prev(after);
  const Driven& b = *after;
  constexpr double kGap_s = 0.3;
  const double gap_s = to_seconds(b.stamp - a.stamp);
  if (gap_s > kGap_s) return std::nullopt;
  const double share = to_seconds(stamp - a.stamp) / gap_s;
  return Driven{stamp, a.way_m + share * (b.way_m - a.way_m),
                a.turned_rad + share * (b.turned_rad - a.turned_rad)};
}

/// What a trajectory and odometry say of the same second of a drive.
struct Stretch {
  double lasts_s = 0;
  double way_m = 0;
  double told_rad = 0;    ///< by odometry
  double turned_rad = 0;  ///< by the trajectory, but for whole turns
};

std::vector<Stretch> stretches_of(const Trajectory& trajectory, const std::vector<Matrix6>& covariance,
                                  const std::vector<Odometry>& odometry) {
  constexpr double kStretch_s = 1;
  constexpr double kLongest_s = 1.5;
  constexpr double kKnown_rad = 0.009;
  constexpr double kLeastWay_m = 0.05;
  if (covariance.size() != trajectory.size()) return {};
  const std::vector<Driven> sums = sums_of(odometry);
  std::vector<Stretch> stretches;
  std::optional<Driven> from;
  double from_yaw = 0;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const SensorTime stamp = trajectory[i].stamp;
    if (from && to_seconds(stamp - from->stamp) < kStretch_s) continue;
    if (std::sqrt(std::max(0.0, covariance[i](5, 5))) > kKnown_rad) continue;
    const auto to = at(sums, stamp);
    if (!to) continue;
    const double yaw = project_to_plane(trajectory[i].map_T_base).yaw();
    if (from && to_seconds(stamp - from->stamp) < kLongest_s && to->way_m - from->way_m > kLeastWay_m)
      stretches.push_back({to_seconds(stamp - from->stamp), to->way_m - from->way_m,
                           to->turned_rad - from->turned_rad, yaw - from_yaw});
    from = to;
    from_yaw = yaw;
  }
  return stretches;
}

constexpr std::size_t kFewest = 10;

}  // namespace

std::optional<TurnNoise> turn_noise(const Trajectory& trajectory, const std::vector<Matrix6>& covariance,
                                    const std::vector<Odometry>& odometry, double yaw_scale) {
  const std::vector<Stretch> stretches = stretches_of(trajectory, covariance, odometry);
  if (stretches.size() < kFewest) return std::nullopt;
  double squares = 0;
  double way = 0;
  double worth = 0;
  for (const Stretch& s : stretches) {
    const double off = straight(s.turned_rad - yaw_scale * s.told_rad);
    squares += off * off;
    way += s.way_m;
    worth += s.told_rad * s.told_rad / s.way_m;
  }
  TurnNoise noise{.rad_sqrt_m = std::sqrt(squares / way), .stretches = static_cast<int>(stretches.size())};
  noise.scale_sigma = worth > 0 ? noise.rad_sqrt_m / std::sqrt(worth) : 0;
  return noise;
}

std::optional<double> turn_scale(const Trajectory& trajectory, const std::vector<Matrix6>& covariance,
                                 const std::vector<Odometry>& odometry) {
  const std::vector<Stretch> stretches = stretches_of(trajectory, covariance, odometry);
  double both = 0;
  double worth = 0;
  for (const Stretch& s : stretches) {
    const double turned_rad = straight(s.turned_rad);
    both += s.told_rad * turned_rad / s.way_m;
    worth += turned_rad * turned_rad / s.way_m;
  }
  if (stretches.size() < kFewest || !(both > 0)) return std::nullopt;
  return worth / both;
}

std::optional<double> turn_scale_sigma(const Trajectory& trajectory, const std::vector<Matrix6>& covariance,
                                       const std::vector<Odometry>& odometry) {
  const std::vector<Stretch> stretches = stretches_of(trajectory, covariance, odometry);
  if (stretches.size() < kFewest) return std::nullopt;
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  double squares = 0;
  for (const Stretch& s : stretches) {
    const Eigen::Vector2d row(straight(s.turned_rad), s.lasts_s);
    A += row * row.transpose();
    b += s.told_rad * row;
    squares += s.told_rad * s.told_rad;
  }
  constexpr double kAlike = 0.7;
  const double determinant = A.determinant();
  const double correlation = A(0, 1) / std::sqrt(A(0, 0) * A(1, 1));
  if (!(determinant > 0) || !(std::abs(correlation) > kAlike)) return std::nullopt;
  const Eigen::Vector2d x = A.ldlt().solve(b);  // told turn over true turn, and error of the rate
  const double left_over = std::max(0.0, squares - b.dot(x)) / static_cast<double>(stretches.size() - 2);
  const double sigma = std::sqrt(left_over * A(1, 1) / determinant);
  return sigma / (x[0] * x[0]);
}

}  // namespace waymark
