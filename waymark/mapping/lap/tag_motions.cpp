#include "waymark/mapping/lap/tag_motions.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/order_statistics.hpp"

namespace waymark::internal {
namespace {

/// Covariance of the motion according to one tag, in the left tangent of the first base frame.
Eigen::Matrix3d covariance_of(const Uncertain<SE2>& before, const Uncertain<SE2>& after, const SE2& motion) {
  const Eigen::Matrix3d Ad = motion.adjoint();
  return before.covariance + Ad * after.covariance * Ad.transpose();
}

}  // namespace

std::optional<ObservedMotion> motion_by_tags(const FloorFrame& from, const FloorFrame& to) {
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> turn;
  ObservedMotion result{.from = from.stamp, .to = to.stamp, .sigma_m = 1e9, .sigma_rad = 1e9};
  for (const FloorObservation& a : from.tags) {
    for (const FloorObservation& b : to.tags) {
      if (a.tag != b.tag) continue;
      const Uncertain<SE2>& before = a.base_X_tag.front().a_X_b;
      const Uncertain<SE2>& after = b.base_X_tag.front().a_X_b;
      const SE2 motion = before.mean * after.mean.inverse();
      const SE2::Tangent twist = motion.log();
      x.push_back(twist[0]);
      y.push_back(twist[1]);
      turn.push_back(twist[2]);
      const Eigen::Matrix3d P = covariance_of(before, after, motion);
      result.sigma_m = std::min(result.sigma_m, std::sqrt(std::max(0.0, P(0, 0))));
      result.sigma_rad = std::min(result.sigma_rad, std::sqrt(std::max(0.0, P(2, 2))));
    }
  }
  if (x.empty()) return std::nullopt;
  result.twist = {median(std::move(x)), median(std::move(y)), median(std::move(turn))};
  return result;
}

}  // namespace waymark::internal

namespace waymark {

std::vector<ObservedMotion> motions_by_tags(const std::vector<ObservedFrame>& observed,
                                            const SE3& base_T_cam) {
  constexpr double kMinDuration_s = 0.8;
  constexpr double kMaxDuration_s = 1.6;
  const internal::TagShapes shapes = internal::tag_shapes(observed, base_T_cam, {});
  std::vector<ObservedMotion> motions;
  std::optional<internal::FloorFrame> from;
  for (const ObservedFrame& frame : observed) {
    if (frame.base_T_cam || frame.tags.empty()) continue;
    const double since_s = from ? to_seconds(frame.stamp - from->stamp) : 0;
    if (from && since_s < kMinDuration_s) continue;
    internal::FloorFrame to = internal::floor_frame(frame, shapes, base_T_cam, {});
    if (from && since_s <= kMaxDuration_s) {
      const auto motion = internal::motion_by_tags(*from, to);
      if (!motion) continue;  // a later frame may have common tags
      motions.push_back(*motion);
    }
    from = std::move(to);
  }
  return motions;
}

}  // namespace waymark
