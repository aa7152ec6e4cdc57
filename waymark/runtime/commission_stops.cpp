#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/runtime/commission_lines.hpp"

namespace waymark {
namespace {

using V = CommissionVerdict;

/// Speed of a robot at its outer edge: of its middle, and of turning at 0.2 m from it. Whatever its unit.
double pace_of(const Odometry& odometry) {
  constexpr double kEdge_m = 0.2;
  return std::abs(odometry.speed_m_s) + kEdge_m * std::abs(odometry.yaw_rate_rad_s);
}

/// Axes of a position as others may have them: reversed and swapped.
struct AxesFault {
  Eigen::Matrix2d sent_R_right;
  const char* words;
};

std::array<AxesFault, 8> axes_faults() {
  const auto m = [](double a, double b, double c, double d) {
    Eigen::Matrix2d made;
    made << a, b, c, d;
    return made;
  };
  return {{{m(1, 0, 0, 1), ""},
           {m(1, 0, 0, -1), "odometry.y_m is reversed: left must be positive"},
           {m(-1, 0, 0, 1), "odometry.x_m is reversed: forward must be positive"},
           {m(-1, 0, 0, -1), ""},  // backward: judge_forward() knows whether it should be
           {m(0, 1, 1, 0), "odometry.x_m and odometry.y_m are swapped"},
           {m(0, 1, -1, 0), "odometry.x_m and odometry.y_m are swapped, and y_m is reversed"},
           {m(0, -1, 1, 0), "odometry.x_m and odometry.y_m are swapped, and x_m is reversed"},
           {m(0, -1, -1, 0), "odometry.x_m and odometry.y_m are swapped and reversed"}}};
}

bool explains(const AxesFault& fault, const OdometryLeg& leg) {
  constexpr double kNear = 0.9;  // cosine
  const Eigen::Vector2d ahead(std::cos(leg.yaw_rad), std::sin(leg.yaw_rad));
  return (fault.sent_R_right * ahead).dot(leg.moved_m.normalized()) > kNear;
}

}  // namespace

std::vector<CommissionLine> judge_axes(const std::vector<OdometryLeg>& legs) {
  std::vector<OdometryLeg> ways;
  for (const OdometryLeg& leg : legs) {
    if (leg.moved_m.norm() > 0) ways.push_back(leg);
  }
  if (ways.empty()) return {};
  for (const AxesFault& fault : axes_faults()) {
    if (!std::ranges::all_of(ways, [&](const OdometryLeg& leg) { return explains(fault, leg); })) continue;
    if (*fault.words == '\0') return {{"odometry.axes", V::Ok, "the position moves along yaw", ""}};
    return {{"odometry.axes", V::Fail, fault.words, "odometry.x_m and odometry.y_m of the robot's messages"}};
  }
  return {{"odometry.axes", V::Fail, "the position does not move along yaw",
           "odometry.x_m, odometry.y_m and odometry.yaw_rad of the robot's messages"}};
}

std::vector<CommissionLine> judge_standing(const MotionTrace& standing) {
  if (standing.imu.empty()) return {};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d turning = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : standing.imu) {
    sum += sample.linear_acceleration_m_s2;
    turning += sample.angular_velocity_rad_s;
  }
  const auto count = static_cast<double>(standing.imu.size());
  const Eigen::Vector3d force = sum / count;
  constexpr double kGravity = 9.81;
  constexpr const char* kMend = "imu.linear_acceleration_m_s2 of the robot's messages";
  const std::string measured =
      fmt::format("({:.2f}, {:.2f}, {:.2f}) m/s2 while it stands", force.x(), force.y(), force.z());
  std::vector<CommissionLine> lines = {{"imu.linear_acceleration_m_s2", V::Ok, measured, ""}};
  CommissionLine& line = lines.back();
  if (force.norm() < 1e-3) {
    line = {line.key, V::Warn, "is zero: not sent, or a simulator without gravity", kMend};
  } else if (std::abs(force.norm() - 1) < 0.2) {
    line = {line.key, V::Fail, "is in g instead of m/s2: " + measured, kMend};
  } else if (std::abs(force.norm() / kGravity - 1) > 0.2) {
    line = {line.key, V::Fail, "is not 9.81 m/s2: " + measured, kMend};
  } else if (force.z() < 0.9 * force.norm()) {
    line = {line.key, V::Fail, "does not point up along z (base axes: x forward, y left, z up): " + measured,
            kMend};
  }
  constexpr double kMostBias_rad_s = 0.05;
  if (turning.norm() / count > kMostBias_rad_s)
    lines.push_back(
        {"imu.bias", V::Warn,
         fmt::format("the gyro turns by {:.3f} rad/s while the robot stands", turning.norm() / count),
         "a calibration of the IMU by its driver"});
  return lines;
}

MotionTiming timing_of(const MotionTrace& trace) {
  MotionTiming timing;
  if (!trace.began || !trace.ceased) return timing;
  std::vector<double> paces;
  for (const Odometry& odometry : steady_part(trace, 0.6).odometry) paces.push_back(pace_of(odometry));
  const double steady = median(paces);
  const Odometry* at_end = nullptr;
  constexpr double kStanding = 0.15;  // of the pace before: noise of a twist is less
  if (!(steady > 0)) return timing;
  for (const Odometry& odometry : trace.odometry) {
    const double pace = pace_of(odometry);
    if (odometry.stamp >= *trace.began && pace >= steady / 2 && !timing.response_s)
      timing.response_s = to_seconds(odometry.stamp - *trace.began);
    if (odometry.stamp < *trace.ceased) {
      at_end = &odometry;
      continue;
    }
    timing.watched_s = to_seconds(odometry.stamp - *trace.ceased);
    if (pace > kStanding * steady) {
      timing.stopping_s.reset();
      if (at_end != nullptr)
        timing.stopping_m = (odometry.odom_T_base.translation() - at_end->odom_T_base.translation()).norm();
    } else if (!timing.stopping_s) {
      timing.stopping_s = timing.watched_s;
      if (at_end != nullptr)
        timing.stopping_m = (odometry.odom_T_base.translation() - at_end->odom_T_base.translation()).norm();
    }
  }
  return timing;
}

CommissionLine judge_stop(const std::string& key, const MotionTiming& timing, double allowed_s) {
  constexpr double kUsual_s = 0.6;
  constexpr double kMost_s = 1;
  constexpr const char* kMend = "the robot's program, which must obey zero at once";
  if (!timing.response_s)
    return {key, V::Fail, "cannot be judged: the robot did not move before it",
            "odometry of the robot's messages"};
  if (!timing.stopping_s)
    return {key, V::Fail, fmt::format("the robot did not stand within {:.2f} s", timing.watched_s), kMend};
  CommissionLine line{
      key, V::Ok, fmt::format("stands after {:.2f} s and {:.3f} m", *timing.stopping_s, timing.stopping_m),
      ""};
  if (*timing.stopping_s > kUsual_s + allowed_s) line.verdict = V::Warn;
  if (*timing.stopping_s > kMost_s + allowed_s) line.verdict = V::Fail;
  if (line.verdict != V::Ok) line.mend = kMend;
  return line;
}

CommissionLine judge_response(const MotionTiming& timing) {
  constexpr double kUsual_s = 0.4;
  constexpr double kMost_s = 1;
  if (!timing.response_s)
    return {"latency", V::Fail, "the robot does not move",
            "command.speed_m_s where the robot's program obeys it"};
  CommissionLine line{"latency", V::Ok,
                      fmt::format("half the speed is reached {:.2f} s after the command", *timing.response_s),
                      ""};
  if (*timing.response_s > kUsual_s) line.verdict = V::Warn;
  if (*timing.response_s > kMost_s) line.verdict = V::Fail;
  if (line.verdict != V::Ok) line.mend = "the way of a command through the robot's program";
  return line;
}

}  // namespace waymark
