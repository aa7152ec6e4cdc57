#pragma once

#include <optional>
#include <vector>

#include "waymark/families/family.hpp"
#include "waymark/localization/tracker.hpp"

namespace waymark {

/// The right-invariant filter, fed sample by sample: motion from wheels and gyro; tags as corners, poses or
/// points; ranges and bearings. Samples may be up to one second late. They are inserted at their stamps, and
/// later samples are processed again, so the result is the same as if all had arrived in order. For the
/// equations, see docs/concepts/localization.md. All memory is allocated at construction.
class RiekfLocalizer final : public LocalizationMethod {
 public:
  RiekfLocalizer(Landmarks landmarks, MountedSensor sensor, const RiekfOptions& options = {},
                 ErrorState error = ErrorState::RightInvariant);

  void add(const TagFrame& frame) override;
  void add(const Odometry& odometry) override;
  void add(const ImuSample& imu) override { input_.add(imu); }
  void add(const TagPoseFrame& frame) override;
  void add(const RangeBearing& seen) override;
  [[nodiscard]] std::optional<LocalizationEstimate> estimate() const override { return tracker_.estimate(); }
  [[nodiscard]] const std::vector<NisRecord>& comparisons() const override { return tracker_.comparisons(); }
  void clear_comparisons() override { tracker_.comparisons().clear(); }
  [[nodiscard]] std::optional<TagFix> tag_fix() const override;
  [[nodiscard]] std::vector<std::string> problems() const override;

  void start_from(const SE2& map_T_base, double sigma_m, double sigma_rad) override;
  bool restart_from(const GivenPose& given) override;
  [[nodiscard]] RiekfLocalizer* filter() override { return this; }

  /// From now on, estimates and uses the camera latency if the innovations show that the given one is wrong.
  void estimate_camera_latency() { estimates_camera_latency_ = true; }
  [[nodiscard]] double camera_latency_s() const { return to_seconds(camera_latency_); }

  [[nodiscard]] Tracker& tracker() { return tracker_; }
  [[nodiscard]] const Tracker& tracker() const { return tracker_; }
  [[nodiscard]] int too_late() const { return too_late_; }
  [[nodiscard]] int rewinds() const { return rewinds_; }

 private:
  static constexpr std::size_t kSnapshots = 13;
  FrameObservations* place(SensorTime stamp);
  void run();
  void advance_to(SensorTime stamp);
  [[nodiscard]] TrackState& snapshot_at(std::size_t age) {
    return snapshots_[(snapshot_first_ + age) % kSnapshots];
  }
  void snapshot();
  bool rewind(SensorTime before);
  void cover(SensorTime stamp);
  void correct_camera_latency();

  MotionInput input_;
  Timeline timeline_;
  Tracker tracker_;
  std::vector<TrackState> snapshots_;  ///< ring buffer, oldest first
  std::size_t snapshot_first_ = 0;
  std::size_t snapshot_count_ = 0;
  Duration camera_latency_;
  Duration given_camera_latency_;
  bool estimates_camera_latency_ = false;
  bool moved_ = false;  ///< odometry has been added
  FrameObservations* open_ = nullptr;
  FrameObservations newest_{};  ///< observations from the newest image
  int too_late_ = 0;
  int rewinds_ = 0;
  int frames_ = 0;
  int observations_ = 0;
  int mapped_ = 0;
  std::optional<FamilyId>
      other_family_{};  ///< the family of an observed tag whose number is in the map under another family
  int over_limit_ = 0;
  int unreliable_ = 0;  ///< tags of the map whose corners are unreliable
};

}  // namespace waymark
