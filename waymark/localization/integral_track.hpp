#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Integrals of three measured rates as functions of time, linear between samples.
class IntegralTrack {
 public:
  /// Rotation about each axis of the gyro [rad]. Samples that are not finite or not later than the previous
  /// one are skipped. Times are in seconds since `epoch`.
  [[nodiscard]] static IntegralTrack of_gyro(const std::vector<ImuSample>& samples, SensorTime epoch);
  /// Distance along base x [m], turn [rad], and path length [m] according to the odometry. A reset of the
  /// odometry is a gap. Samples that are not finite or not later than the previous one are skipped.
  [[nodiscard]] static IntegralTrack of_odometry(const std::vector<Odometry>& samples, SensorTime epoch);

  /// Change between two times; empty if samples are missing between them or at either of them. O(log n).
  [[nodiscard]] std::optional<Eigen::Vector3d> change(double from_s, double to_s) const;
  /// Mean rates over 0.1 s around a time, per second; empty if samples are missing there. O(log n).
  [[nodiscard]] std::optional<Eigen::Vector3d> rate(double at_s) const;

  [[nodiscard]] bool empty() const { return points_.empty(); }
  [[nodiscard]] double first_s() const { return points_.front().time_s; }
  [[nodiscard]] double last_s() const { return points_.back().time_s; }

 private:
  struct Point {
    double time_s = 0;
    Eigen::Vector3d integral = Eigen::Vector3d::Zero();
    int gaps = 0;  ///< number of gaps before this point
  };
  void add(double time_s, const Eigen::Vector3d& step, bool gap);
  [[nodiscard]] std::optional<Point> at(double time_s) const;

  std::vector<Point> points_;
};

}  // namespace waymark
