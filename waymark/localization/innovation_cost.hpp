#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <variant>

#include "waymark/localization/innovation_calibration.hpp"

/// The inside of calibrate_by_innovations().
namespace waymark::internal {

constexpr double kCapPerRow = 16;  ///< an outlier counts so much and no more
constexpr int kStretches = 12;     ///< of a drive; every third is held out

/// What one run of the filter costs by its innovations.
struct RunCost {
  double fitted = 0;       ///< sum of NIS over what is fitted, outliers capped
  double fitted_rows = 0;  ///< its degrees of freedom
  double held_out = 0;     ///< the same of what is held out
  double held_out_rows = 0;
  std::size_t observations = 0;
  bool lost = false;  ///< the robot, for longer than with other numbers: what was seen then costs nothing

  [[nodiscard]] double rows() const { return fitted_rows + held_out_rows; }
  [[nodiscard]] double per_row() const { return rows() > 0 ? (fitted + held_out) / rows() : 0; }
  [[nodiscard]] double held_out_per_row() const { return held_out_rows > 0 ? held_out / held_out_rows : 0; }
  /// What a search compares.
  [[nodiscard]] double fitted_per_row() const {
    return lost || !(fitted_rows > 0) ? std::numeric_limits<double>::infinity() : fitted / fitted_rows;
  }
};

/// Runs of the filter over one drive with one set of numbers or another.
class InnovationRuns {
 public:
  InnovationRuns(std::span<const Sample> samples, const Landmarks& landmarks, const MountedSensor& sensor,
                 const RiekfOptions& options, const InnovationFitOptions& fit)
      : samples_(samples),
        landmarks_(landmarks),
        sensor_(sensor),
        options_(options),
        keep_going_(fit.keep_going) {
    // What is sought must show in the innovations, not be explained by something else.
    options_.mounting_sigma_m = options_.mounting_sigma_rad = 0;
    options_.motion.distance_scale_sigma = options_.motion.yaw_scale_sigma = 0;
    constexpr double kSlip_s = 0.01;
    options_.motion.slip_sigma_s = std::min(options_.motion.slip_sigma_s, kSlip_s);
    options_.motion.parts_err_apart = true;
  }

  /// With observations so many times as uncertain as they are: a wide net first. `errors` becomes what the
  /// part that is not held out tells of the errors of the numbers.
  RunCost operator()(const CalibratedNumbers& numbers, double noise_ratio,
                     SystematicErrors* errors = nullptr) {
    stopped = stopped || (keep_going_ && !keep_going_());
    RunCost cost;
    if (stopped) return cost;
    ++runs;
    RiekfLocalizer filter(landmarks_, calibrated_sensor(sensor_, numbers),
                          calibrated_options(widened(noise_ratio), numbers));
    if (errors != nullptr) filter.tracker().systematic().keep_clusters();
    for (const Sample& sample : samples_) {
      filter.tracker().systematic().count_in(!holds_out || !held_out(stamp_of(sample)));
      if (const auto* odometry = std::get_if<Odometry>(&sample)) filter.add(*odometry);
      if (const auto* imu = std::get_if<ImuSample>(&sample)) filter.add(*imu);
      if (const auto* tags = std::get_if<TagFrame>(&sample)) filter.add(*tags);
      if (const auto* tags = std::get_if<TagPoseFrame>(&sample)) filter.add(*tags);
      if (const auto* seen = std::get_if<RangeBearing>(&sample)) filter.add(*seen);
      take(filter, cost);
    }
    if (errors != nullptr) *errors = filter.tracker().systematic();
    constexpr double kKept = 0.9;
    most_rows_ = std::max(most_rows_, cost.rows());
    cost.lost = cost.rows() < kKept * most_rows_;
    return cost;
  }

  int runs = 0;
  bool holds_out = true;  ///< a third of the drive from `errors`
  bool stopped = false;   ///< by who waits for it; what a run said since then is nothing

 private:
  [[nodiscard]] RiekfOptions widened(double ratio) const {
    RiekfOptions wide = options_;
    wide.corner_noise_ratio *= ratio;
    wide.point_sigma_m *= ratio;
    wide.range_sigma_m *= ratio;
    wide.bearing_sigma_rad *= ratio;
    return wide;
  }

  void take(RiekfLocalizer& filter, RunCost& cost) const {
    for (const NisRecord& record : filter.comparisons()) {
      const double nis = std::min(record.nis, kCapPerRow * record.rows);
      const bool held = held_out(record.stamp);
      (held ? cost.held_out : cost.fitted) += nis;
      (held ? cost.held_out_rows : cost.fitted_rows) += record.rows;
      ++cost.observations;
    }
    filter.clear_comparisons();
  }

  [[nodiscard]] bool held_out(SensorTime stamp) const {
    const SensorTime first = stamp_of(samples_.front());
    const double share =
        to_seconds(stamp - first) / std::max(1e-9, to_seconds(stamp_of(samples_.back()) - first));
    return static_cast<int>(share * kStretches) % 3 == 2;
  }

  std::span<const Sample> samples_;
  const Landmarks& landmarks_;
  MountedSensor sensor_;
  RiekfOptions options_;
  std::function<bool()> keep_going_;
  double most_rows_ = 0;  ///< of all runs
};

}  // namespace waymark::internal
