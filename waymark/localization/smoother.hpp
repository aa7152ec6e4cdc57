#pragma once

#include <span>
#include <vector>

#include "waymark/localization/riekf_localizer.hpp"
#include "waymark/localization/tracker.hpp"

namespace waymark {

/// Smooths a run with the method of Rauch, Tung and Striebel ("Maximum Likelihood Estimates of Linear Dynamic
/// Systems", AIAA Journal 3(8), 1965), applied to the invariant error, (18). Returns one estimate per step,
/// in order. Chains (separated by a new start or a jump) are smoothed separately. Considered errors (of tags
/// and of the mounting) are treated as in the filter. O(steps).
[[nodiscard]] std::vector<LocalizationEstimate> smooth(std::span<const TraceStep> trace);

/// Smoothed estimate for the first step that is older than the newest by at most `lag`. Empty as long as the
/// run is shorter than `lag`. O(steps in the lag); does not allocate.
[[nodiscard]] std::optional<LocalizationEstimate> smoothed_before(std::span<const TraceStep> trace,
                                                                  Duration lag);

/// Fixed-lag smoother, fed like the filter: estimates the pose one lag ago from all samples up to the newest,
/// (18). There is no estimate until the first lag has passed. The estimate for a given time equals the result
/// of smooth() for a run that ends one lag later. All memory is allocated at construction.
class FixedLagSmoother final : public LocalizationMethod {
 public:
  /// The lag is RiekfOptions::lag_s.
  FixedLagSmoother(Landmarks landmarks, MountedSensor sensor, const RiekfOptions& options);

  void add(const TagFrame& frame) override { filter_.add(frame); }
  void add(const Odometry& odometry) override { filter_.add(odometry); }
  void add(const ImuSample& imu) override { filter_.add(imu); }
  void add(const TagPoseFrame& frame) override { filter_.add(frame); }
  void add(const RangeBearing& seen) override { filter_.add(seen); }
  /// Its stamp is one lag before the latest motion.
  [[nodiscard]] std::optional<LocalizationEstimate> estimate() const override;
  [[nodiscard]] const std::vector<NisRecord>& comparisons() const override { return filter_.comparisons(); }
  void clear_comparisons() override { filter_.clear_comparisons(); }
  [[nodiscard]] std::optional<TagFix> tag_fix() const override { return filter_.tag_fix(); }
  [[nodiscard]] std::vector<std::string> problems() const override { return filter_.problems(); }

  void start_from(const SE2& map_T_base, double sigma_m, double sigma_rad) override {
    filter_.start_from(map_T_base, sigma_m, sigma_rad);
  }
  bool restart_from(const GivenPose& given) override { return filter_.restart_from(given); }
  [[nodiscard]] RiekfLocalizer* filter() override { return &filter_; }

 private:
  Duration lag_;
  RiekfLocalizer filter_;
};

}  // namespace waymark
