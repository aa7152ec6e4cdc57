#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "waymark/localization/observation.hpp"
#include "waymark/localization/riekf.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A step of motion with its time.
struct MotionSegment {
  SensorTime from{};
  SensorTime to{};
  MotionStep step{};

  /// The part of it up to `stamp`, and the rest: equal twists.
  [[nodiscard]] MotionStep part(SensorTime begin, SensorTime end) const;
};

/// Makes steps of motion of what wheels and gyro say. Odometry gives the way; how the robot turned, the gyro
/// where there is one (MotionInput::rotation).
class MotionInput {
 public:
  explicit MotionInput(const RiekfOptions& options);

  void add(const ImuSample& imu);
  /// The motion since the odometry before; nothing for the first, for one that is not finite or does not go
  /// forwards in time.
  [[nodiscard]] std::optional<MotionSegment> add(const Odometry& odometry);
  /// What may have happened until `to` when nobody says: the last twist goes on, and is doubted.
  [[nodiscard]] MotionSegment guess(SensorTime from, SensorTime to) const;

  [[nodiscard]] int not_forwards() const { return not_forwards_; }
  /// Steps that no robot can have driven.
  [[nodiscard]] int jumps() const { return jumps_; }
  [[nodiscard]] int not_finite() const { return not_finite_; }

 private:
  struct Turned {
    SensorTime stamp{};
    double angle_rad = 0;  ///< since the first
    double rate_rad_s = 0;
  };
  [[nodiscard]] std::optional<double> gyro_angle(SensorTime stamp) const;
  [[nodiscard]] bool stands_still(const MotionStep& step, double wheel_turn_rad) const;
  [[nodiscard]] double dispute(double wheel_turn_rad, const MotionStep& step);
  [[nodiscard]] static bool impossible(const MotionStep& step);
  [[nodiscard]] MotionStep step_of(const Odometry& a, const Odometry& b);

  static constexpr std::size_t kKept = 256;
  bool use_gyro_;
  double bias_sigma_rad_s_;
  double wheel_yaw_rad_sqrt_m_;
  double odometry_scale_;
  double yaw_gain_;
  double gyro_gain_;
  double gyro_bias_rad_s_;
  std::optional<Odometry> last_{};
  std::array<Turned, kKept> turned_{};
  std::size_t turned_count_ = 0;  ///< ever
  double standing_s_ = 0;
  double gyro_rate_ = 0;  ///< both smoothed [rad/s]
  double wheel_rate_ = 0;
  int not_forwards_ = 0;
  int not_finite_ = 0;
  int jumps_ = 0;
  MotionStep last_step_{};
};

/// All that was seen at one moment.
struct FrameObservations {
  static constexpr std::size_t kMaxObservations = 16;
  SensorTime stamp{};
  std::uint64_t number = 0;  ///< order of arrival among equal stamps
  bool sealed = true;        ///< no more will be added
  bool reported = false;
  std::array<Observation, kMaxObservations> seen{};
  std::size_t count = 0;
};

/// The last second of motion and looks, in order of stamps: what a filter needs to go back in time. All
/// memory is taken at construction.
class Timeline {
 public:
  Timeline(std::size_t segments, std::size_t frames);

  void add(const MotionSegment& segment);
  /// A slot for a look, put where its stamp belongs. The oldest goes when all are taken.
  FrameObservations& add_frame(SensorTime stamp);

  [[nodiscard]] SensorTime covered() const { return covered_; }
  [[nodiscard]] bool empty() const { return segment_count_ == 0; }
  /// The oldest moment to which one can go back.
  [[nodiscard]] SensorTime begin() const;
  /// Forgets what ended before.
  void forget_before(SensorTime stamp);

  [[nodiscard]] std::size_t segments() const { return segment_count_; }
  [[nodiscard]] const MotionSegment& segment(std::size_t i) const {
    return segments_[(first_segment_ + i) % segments_.size()];
  }
  /// In order of (stamp, arrival).
  [[nodiscard]] std::size_t frames() const { return order_count_; }
  [[nodiscard]] FrameObservations& frame(std::size_t i) { return frames_[order_[i]]; }

 private:
  std::vector<MotionSegment> segments_;
  std::size_t first_segment_ = 0;
  std::size_t segment_count_ = 0;
  std::vector<FrameObservations> frames_;
  std::vector<std::uint32_t> order_;  ///< slots of looks in order of time, then the free ones
  std::size_t order_count_ = 0;
  std::uint64_t numbers_ = 0;
  SensorTime covered_{};
};

}  // namespace waymark
