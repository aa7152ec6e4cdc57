#include "tests/support/posterior_bound.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/LU>

#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark::testing {
namespace {

/// x, y, yaw, scale, bias, slip, sliding velocity, direction of odom; errors of the yaw rate and of the
/// velocities in odom during one odometry message.
enum : Eigen::Index { kX, kY, kYaw, kScale, kBias, kSlip, kSlide, kAxes, kTurning, kWalkX, kWalkY, kStates };
using State = Eigen::Matrix<double, kStates, kStates>;

std::optional<SE2> true_pose(const std::vector<TruthPose>& truth, SensorTime stamp) {
  const auto next = std::ranges::lower_bound(truth, stamp, {}, &TruthPose::stamp);
  if (next == truth.end()) return std::nullopt;
  if (next->stamp == stamp) return project_to_plane(next->map_T_base);
  if (next == truth.begin()) return std::nullopt;
  const TruthPose& before = *(next - 1);
  const double u = to_seconds(stamp - before.stamp) / to_seconds(next->stamp - before.stamp);
  return interpolate(project_to_plane(before.map_T_base), project_to_plane(next->map_T_base), u);
}

State at_the_start(const TrueNoise& noise) {
  const auto sq = [](double x) { return x * x; };
  State P = State::Zero();
  P.diagonal() << sq(noise.start_m), sq(noise.start_m), sq(noise.start_rad), sq(noise.scale),
      sq(noise.bias_rad_s), sq(noise.slip_s), sq(noise.slide_m_s), sq(noise.askew_rad) + sq(noise.start_rad),
      0, 0, 0;
  P(kYaw, kAxes) = P(kAxes, kYaw) = sq(noise.start_rad);
  return P;
}

/// Adds the sliding over an interval to the position along `aside` and to the velocity: an integrated
/// Gauss-Markov process.
void add_sliding(State& P, const Eigen::Vector2d& aside, double dt_s, const TrueNoise& noise) {
  const double time_s = noise.slide_time_s;
  const double kept = std::exp(-dt_s / time_s);
  const double variance = noise.slide_m_s * noise.slide_m_s;
  const double way2 = variance * time_s * (2 * dt_s - time_s * (3 - 4 * kept + kept * kept));
  const Eigen::Vector2d both = variance * time_s * (1 - kept) * (1 - kept) * aside;
  P.block<2, 2>(kX, kX) += way2 * aside * aside.transpose();
  P.block<2, 1>(kX, kSlide) += both;
  P.block<1, 2>(kSlide, kX) += both.transpose();
  P(kSlide, kSlide) += variance * (1 - kept * kept);
}

/// F P F' + Q over an interval of the true motion.
State moved(const State& P, const SE2& from, const SE2& to, double dt_s, const TrueNoise& noise) {
  const Eigen::Vector2d way = to.translation() - from.translation();
  const Eigen::Vector2d turned(-way.y(), way.x());
  const double yaw = from.yaw() + (from.inverse() * to).yaw() / 2;
  const Eigen::Vector2d ahead(std::cos(yaw), std::sin(yaw));
  const Eigen::Vector2d aside(-ahead.y(), ahead.x());
  State F = State::Identity();
  F.block<2, 1>(kX, noise.way_in_odom ? kAxes : kYaw) += turned;
  if (noise.way_in_odom) {
    F(kX, kWalkX) = F(kY, kWalkY) = dt_s;
  } else {
    const double turn_rate = (from.inverse() * to).yaw() / dt_s;
    F.block<2, 1>(kX, kScale) = way.dot(ahead) * ahead;
    F.block<2, 1>(kX, kSlip) = way.dot(ahead) * turn_rate * aside;
    F(kSlide, kSlide) = std::exp(-dt_s / noise.slide_time_s);
    F.block<2, 1>(kX, kSlide) = noise.slide_time_s * (1 - F(kSlide, kSlide)) * aside;
    F.block<2, 1>(kX, kBias) = -dt_s * turned / 2;
  }
  F(kYaw, kBias) = -dt_s;
  F(kYaw, kTurning) = dt_s;
  State after = F * P * F.transpose();
  if (!noise.way_in_odom) add_sliding(after, aside, dt_s, noise);
  return after;
}

/// Fisher information of one tag's corners about x, y and yaw.
Eigen::Matrix3d information(const TagDetection& seen, const MappedTag& tag, const CameraModel& camera,
                            const SE3& base_T_cam, const SE2& map_X_base) {
  const auto corners = [&](const Eigen::Vector3d& off) {
    const SE2 X(map_X_base.x() + off.x(), map_X_base.y() + off.y(), map_X_base.yaw() + off.z());
    const SE3 cam_T_tag = (lift(X) * base_T_cam).inverse() * tag.map_T_tag;
    Eigen::Matrix<double, 8, 1> px = Eigen::Matrix<double, 8, 1>::Zero();
    Eigen::Index row = 0;
    for (const Eigen::Vector3d& p : tag_corners(tag.size_m)) {
      if (const auto projected = camera.project(cam_T_tag * p)) px.segment<2>(row) = *projected;
      row += 2;
    }
    return px;
  };
  Eigen::Matrix<double, 8, 3> H;
  constexpr double kStep = 1e-5;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Vector3d off = kStep * Eigen::Vector3d::Unit(i);
    H.col(i) = (corners(off) - corners(-off)) / (2 * kStep);
  }
  return H.transpose() * seen.corner_covariance_px2.value().inverse() * H;
}

/// (P^-1 + E J E')^-1 for a P that may be singular.
State seen(const State& P, const Eigen::Matrix3d& J) {
  const Eigen::Matrix<double, kStates, 3> A = P.leftCols<3>();
  const Eigen::Matrix3d inner = (Eigen::Matrix3d::Identity() + J * P.topLeftCorner<3, 3>()).inverse() * J;
  const State after = P - A * inner * A.transpose();
  return (after + after.transpose()) / 2;
}

/// Replaces an error that is constant for a while by an independent one.
void redraw(State& P, Eigen::Index state, double sigma) {
  P.row(state).setZero();
  P.col(state).setZero();
  P(state, state) = sigma * sigma;
}

/// The error of the next odometry message is independent.
void next_message(State& P, const TrueNoise& noise) {
  const double seconds = std::sqrt(noise.message_s);
  redraw(P, kTurning, noise.gyro_rad / seconds);
  redraw(P, kWalkX, noise.walk_m / seconds);
  redraw(P, kWalkY, noise.walk_m / seconds);
}

}  // namespace

std::vector<BoundAt> posterior_bound(const std::vector<Sample>& samples, const std::vector<TruthPose>& truth,
                                     const TagMap& map, const CameraModel& camera, const SE3& base_T_cam,
                                     const TrueNoise& noise) {
  std::vector<BoundAt> all;
  State P = at_the_start(noise);
  SensorTime now = truth.front().stamp;
  SE2 at = project_to_plane(truth.front().map_T_base);
  next_message(P, noise);
  for (const Sample& sample : samples) {
    const auto* frame = std::get_if<TagFrame>(&sample);
    const bool odometry = std::holds_alternative<Odometry>(sample);
    const SensorTime stamp = stamp_of(sample);
    const auto next = true_pose(truth, stamp);
    if ((frame == nullptr && !odometry) || !next || stamp < now) continue;
    if (stamp > now) P = moved(P, at, *next, to_seconds(stamp - now), noise);
    now = stamp;
    at = *next;
    if (odometry) {
      all.push_back({now, P.topLeftCorner<3, 3>()});
      next_message(P, noise);
    }
    if (frame == nullptr) continue;
    Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
    for (const TagDetection& detection : frame->detections) {
      const MappedTag* tag = map.find(detection.tag);
      if (tag != nullptr) J += information(detection, *tag, camera, base_T_cam, at);
    }
    P = seen(P, J);
  }
  return all;
}

}  // namespace waymark::testing
