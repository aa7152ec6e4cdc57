#pragma once

#include <span>
#include <vector>

#include "waymark/localization/riekf_localizer.hpp"
#include "waymark/localization/tracker.hpp"

namespace waymark {

/// What the run looks like in hindsight: Rauch, Tung and Striebel ("Maximum Likelihood Estimates of Linear
/// Dynamic Systems", AIAA Journal 3(8), 1965) on the invariant error, (18). One estimate for each step, in
/// order. Chains (a new start, a jump) are smoothed one by one. Errors that stay (of tags, of the mounting)
/// count as they do in the filter. O(steps).
[[nodiscard]] std::vector<LocalizationEstimate> smooth(std::span<const TraceStep> trace);

/// The pose a while ago, by all that was seen since: the first of the smoothed steps no older than `lag`.
/// Nothing while the run is shorter. O(steps in the lag), no allocation.
[[nodiscard]] std::optional<LocalizationEstimate> smoothed_before(std::span<const TraceStep> trace,
                                                                  Duration lag);

/// The smoother while the robot drives: fed as the filter is, it says where the robot was a lag ago by all
/// that was seen since, (18). Nothing before the first lag has passed. What it says of a moment is what
/// smooth() would say of it if the run ended a lag later. All memory is taken at construction.
class FixedLagSmoother final : public LocalizationMethod {
 public:
  /// The lag comes from RiekfOptions::lag_s.
  FixedLagSmoother(Landmarks landmarks, MountedSensor sensor, const RiekfOptions& options);

  void add(const TagFrame& frame) override { filter_.add(frame); }
  void add(const Odometry& odometry) override { filter_.add(odometry); }
  void add(const ImuSample& imu) override { filter_.add(imu); }
  void add(const TagPoseFrame& frame) override { filter_.add(frame); }
  void add(const RangeBearing& seen) override { filter_.add(seen); }
  /// Its stamp is a lag older than the newest motion.
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
