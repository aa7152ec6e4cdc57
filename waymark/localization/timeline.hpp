#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "waymark/localization/observation.hpp"
#include "waymark/localization/riekf.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A motion step with its time interval.
struct MotionSegment {
  SensorTime from{};
  SensorTime to{};
  MotionStep step{};

  /// The part between `begin` and `end`, with the same velocity.
  [[nodiscard]] MotionStep part(SensorTime begin, SensorTime end) const;
};

/// Converts wheel odometry and gyro readings to motion steps. The translation comes from odometry; the
/// rotation comes from the gyro if there is one (RiekfOptions::rotation).
class MotionInput {
 public:
  explicit MotionInput(const RiekfOptions& options);

  void add(const ImuSample& imu);
  /// The motion since the previous odometry sample. Empty for the first sample, and for a sample that is not
  /// finite or does not advance in time.
  [[nodiscard]] std::optional<MotionSegment> add(const Odometry& odometry);
  /// Motion extrapolated until `to` if no odometry arrives: the last twist with increased variance.
  [[nodiscard]] MotionSegment guess(SensorTime from, SensorTime to) const;

  [[nodiscard]] int not_forwards() const { return not_forwards_; }
  /// Number of steps that were faster than any robot.
  [[nodiscard]] int jumps() const { return jumps_; }
  [[nodiscard]] int not_finite() const { return not_finite_; }

 private:
  struct Turned {
    SensorTime stamp{};
    double angle_rad = 0;  ///< since the first reading
    double rate_rad_s = 0;
  };
  [[nodiscard]] std::optional<double> gyro_angle(SensorTime stamp) const;
  [[nodiscard]] bool is_standstill(const MotionStep& step, double wheel_turn_rad) const;
  [[nodiscard]] double disagreement(double wheel_turn_rad, const MotionStep& step);
  [[nodiscard]] static bool impossible(const MotionStep& step);
  [[nodiscard]] MotionStep step_of(const Odometry& a, const Odometry& b);

  static constexpr std::size_t kKept = 256;
  bool use_gyro_;
  double bias_sigma_rad_s_;
  double wheel_yaw_rad_sqrt_m_;
  double odometry_scale_;
  double yaw_scale_;
  double gyro_gain_;
  double gyro_bias_rad_s_;
  std::optional<Odometry> last_{};
  std::array<Turned, kKept> turned_{};
  std::size_t turned_count_ = 0;  ///< total count
  double standstill_s_ = 0;
  double gyro_rate_ = 0;  ///< gyro_rate_ and wheel_rate_: smoothed [rad/s]
  double wheel_rate_ = 0;
  int not_forwards_ = 0;
  int not_finite_ = 0;
  int jumps_ = 0;
  MotionStep last_step_{};
};

/// All observations made at one time.
struct FrameObservations {
  static constexpr std::size_t kMaxObservations = 16;
  SensorTime stamp{};
  std::uint64_t number = 0;  ///< order of arrival among frames with equal stamps
  bool sealed = true;        ///< if set, no more observations will be added
  bool reported = false;
  std::array<Observation, kMaxObservations> seen{};
  std::size_t count = 0;
};

/// Motion and observations over the last second in stamp order, which allow a filter to go back in time. All
/// memory is allocated at construction.
class Timeline {
 public:
  Timeline(std::size_t segments, std::size_t frames);

  void add(const MotionSegment& segment);
  /// A slot for a frame, inserted according to its stamp. Overwrites the oldest frame if all slots are in
  /// use.
  FrameObservations& add_frame(SensorTime stamp);

  [[nodiscard]] SensorTime covered() const { return covered_; }
  [[nodiscard]] bool empty() const { return segment_count_ == 0; }
  /// The earliest time to which a filter can rewind.
  [[nodiscard]] SensorTime begin() const;
  /// Discards motion and frames that ended before `stamp`.
  void forget_before(SensorTime stamp);

  [[nodiscard]] std::size_t segments() const { return segment_count_; }
  [[nodiscard]] const MotionSegment& segment(std::size_t i) const {
    return segments_[(first_segment_ + i) % segments_.size()];
  }
  /// Frames in order of (stamp, arrival).
  [[nodiscard]] std::size_t frames() const { return order_count_; }
  [[nodiscard]] FrameObservations& frame(std::size_t i) { return frames_[order_[i]]; }

 private:
  std::vector<MotionSegment> segments_;
  std::size_t first_segment_ = 0;
  std::size_t segment_count_ = 0;
  std::vector<FrameObservations> frames_;
  std::vector<std::uint32_t> order_;  ///< frame slots in use, in time order, followed by the free ones
  std::size_t order_count_ = 0;
  std::uint64_t numbers_ = 0;
  SensorTime covered_{};
};

}  // namespace waymark
