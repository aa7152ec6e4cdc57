#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <span>
#include <variant>

#include <Eigen/Core>

#include "waymark/localization/innovation_calibration.hpp"

/// The inside of calibrate_by_innovations().
namespace waymark::internal {

constexpr double kCapPerRow = 16;     ///< what is not believed counts so much and no more
constexpr Eigen::Index kBlocks = 12;  ///< stretches of a drive
using Blocks = Eigen::Matrix<double, kBlocks, 1>;

/// One run: what its innovations cost.
class Cost {
 public:
  Cost(std::span<const Sample> samples, const Landmarks& landmarks, const MountedSensor& eye,
       const RiekfOptions& options, const CalibratedNumbers& start, const InnovationFitOptions& fit)
      : samples_(samples),
        landmarks_(landmarks),
        eye_(eye),
        options_(options),
        start_(start),
        prior_(fit.prior),
        keep_going_(fit.keep_going) {
    // What is sought must show in the innovations, not be explained by something else.
    options_.mounting_sigma_m = options_.mounting_sigma_rad = 0;
    options_.motion.distance_scale_sigma = options_.motion.yaw_scale_sigma = options_.motion.slip_sigma_s = 0;
    options_.motion.parts_err_apart = true;
  }

  /// Twice the negative logarithm of the likelihood, without its constant.
  double operator()(const CalibratedNumbers& numbers) {
    stopped = stopped || (keep_going_ && !keep_going_());
    if (stopped) return 0;
    ++runs;
    RiekfLocalizer filter(landmarks_, calibrated_sensor(eye_, numbers),
                          calibrated_options(options_, numbers));
    sum_ = 0;
    rows_ = 0;
    blocks_.setZero();
    for (const Sample& sample : samples_) {
      if (const auto* odometry = std::get_if<Odometry>(&sample)) filter.add(*odometry);
      if (const auto* imu = std::get_if<ImuSample>(&sample)) filter.add(*imu);
      if (const auto* tags = std::get_if<TagFrame>(&sample)) filter.add(*tags);
      if (const auto* tags = std::get_if<TagPoseFrame>(&sample)) filter.add(*tags);
      if (const auto* seen = std::get_if<RangeBearing>(&sample)) filter.add(*seen);
      take(filter);
    }
    sightings = filter.news().size() + counted_;
    double prior = 0;
    for (std::size_t i = 0; i < kCalibrated; ++i) prior += std::pow((numbers[i] - start_[i]) / prior_[i], 2);
    return sum_ + prior;
  }
  [[nodiscard]] double per_row() const { return rows_ > 0 ? sum_ / rows_ : 0; }
  [[nodiscard]] double rows() const { return rows_; }
  /// Of the last run, by stretches of the drive.
  [[nodiscard]] const Blocks& blocks() const { return blocks_; }

  int runs = 0;
  std::size_t sightings = 0;
  bool stopped = false;  ///< by who waits for it; what the cost said since then is nothing

 private:
  void take(RiekfLocalizer& filter) {
    for (const NisRecord& record : filter.news()) {
      const double nis = std::min(record.nis, kCapPerRow * record.rows);
      sum_ += nis;
      blocks_[block_of(record.stamp)] += nis;
      rows_ += record.rows;
    }
    counted_ += filter.news().size();
    filter.clear_news();
  }

  [[nodiscard]] Eigen::Index block_of(SensorTime stamp) const {
    const SensorTime first = stamp_of(samples_.front());
    const double share =
        to_seconds(stamp - first) / std::max(1e-9, to_seconds(stamp_of(samples_.back()) - first));
    return std::clamp(static_cast<Eigen::Index>(share * kBlocks), Eigen::Index{0}, kBlocks - 1);
  }

  std::span<const Sample> samples_;
  const Landmarks& landmarks_;
  MountedSensor eye_;
  RiekfOptions options_;
  CalibratedNumbers start_;
  CalibratedNumbers prior_;
  std::function<bool()> keep_going_;
  double sum_ = 0;
  double rows_ = 0;
  Blocks blocks_ = Blocks::Zero();
  std::size_t counted_ = 0;
};

}  // namespace waymark::internal
