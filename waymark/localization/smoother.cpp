#include "waymark/localization/smoother.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark {
namespace {

struct Smoothed {
  SE2 map_T_base{};
  SlowVector slow = SlowVector::Zero();
  StateMatrix P = StateMatrix::Zero();
};

/// Goes from step k + 1 to step k, conditional on the considered errors, because later evidence about those
/// errors must not move the earlier pose.
Smoothed backwards(const TraceStep& k, const TraceStep& next, const Smoothed& after) {
  // Keeps the inverse finite if a state has no variance (a slow state that is switched off).
  const StateMatrix P = next.predicted_P + StateMatrix::Identity() * 1e-15;
  const StateMatrix common = next.transition * k.filtered_P + next.motion_cross_covariance;
  const StateMatrix G = P.ldlt().solve(common).transpose();
  StateVector apart;
  apart << minus(after.map_T_base, next.predicted), after.slow - next.predicted_slow;
  const StateVector correction = G * apart;
  Smoothed now;
  now.map_T_base = SE2::exp(correction.head<3>()) * k.filtered;
  now.slow = k.filtered_slow + correction.tail<5>();
  now.P = internal::symmetrized<8>(k.filtered_P + G * (after.P - next.predicted_P) * G.transpose());
  return now;
}

LocalizationEstimate estimate_of(const TraceStep& step, const Smoothed& smoothed) {
  const Uncertain<SE2> map_X_base{smoothed.map_T_base, smoothed.P.topLeftCorner<3, 3>() + step.lasting_P};
  return {step.stamp, map_X_base.mean, coordinate_covariance(map_X_base), step.certain};
}

/// The smoothed step k, given `after`, the smoothed step k + 1.
Smoothed smoothed_at(std::span<const TraceStep> trace, std::size_t k, const Smoothed& after) {
  const TraceStep& step = trace[k];
  const bool last = k + 1 == trace.size() || trace[k + 1].chain != step.chain;
  if (last) return {step.filtered, step.filtered_slow, step.filtered_P};
  return backwards(step, trace[k + 1], after);
}

}  // namespace

std::vector<LocalizationEstimate> smooth(std::span<const TraceStep> trace) {
  std::vector<LocalizationEstimate> all(trace.size());
  Smoothed after;
  for (std::size_t k = trace.size(); k-- > 0;) {
    after = smoothed_at(trace, k, after);
    all[k] = estimate_of(trace[k], after);
  }
  return all;
}

std::optional<LocalizationEstimate> smoothed_before(std::span<const TraceStep> trace, Duration lag) {
  if (trace.empty() || trace.back().stamp - trace.front().stamp < lag) return std::nullopt;
  const SensorTime from = trace.back().stamp - lag;
  const auto found = std::ranges::lower_bound(trace, from, {}, &TraceStep::stamp);
  const auto first = static_cast<std::size_t>(found - trace.begin());
  Smoothed after;
  for (std::size_t k = trace.size(); k-- > first;) after = smoothed_at(trace, k, after);
  return estimate_of(*found, after);
}

FixedLagSmoother::FixedLagSmoother(Landmarks landmarks, MountedSensor sensor, const RiekfOptions& options)
    : lag_(std::llround(options.lag_s * 1e9)), filter_(std::move(landmarks), std::move(sensor), options) {
  filter_.tracker().keep_trace(lag_);
}

std::optional<LocalizationEstimate> FixedLagSmoother::estimate() const {
  return smoothed_before(filter_.tracker().trace(), lag_);
}

}  // namespace waymark
