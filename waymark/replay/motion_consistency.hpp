#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/replay/motion_predictor.hpp"
#include "waymark/replay/picture_delay.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

struct ConsistencyOptions {
  double window_s = 1.0;
  double contradiction_m = 0.05;
  double contradiction_rad = 0.0873;
  double pushed_m = 0.10;
  double pushed_rad = 0.2;
  double late_pictures_s = 0.2;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.window_s,
          Field{"window_s", "Time of motion over which commands, wheels, gyro and tags are compared.", 0.3,
                10});
    visit(self.contradiction_m,
          Field{"contradiction_m",
                "Stop when two sources of motion differ by more over the window, beyond their uncertainty.",
                0.005, 10});
    visit(self.contradiction_rad,
          Field{"contradiction_rad",
                "Stop when two sources of turning differ by more over the window, beyond their uncertainty.",
                0.005, 6.3});
    visit(
        self.pushed_m,
        Field{
            "pushed_m",
            "Stop when the robot moved by more within the window than its wheels explain, even by slipping, "
            "beyond the uncertainty: it was carried.",
            0.01, 10});
    visit(
        self.pushed_rad,
        Field{"pushed_rad",
              "Stop when the robot turned by more within the window than its commands or wheels explain: it "
              "was carried.",
              0.01, 6.3});
    visit(self.late_pictures_s,
          Field{"late_pictures_s",
                "Stop when turns seen by tags follow those of odometry by more than this time: pictures are "
                "stamped late.",
                0.05, 10});
  }
};

enum class MotionSource : std::uint8_t { Commands, Wheels, Gyro, Tags };

/// What every source says of the motion up to one moment. Sums and poses begin anywhere: differences count.
struct MotionSample {
  double moving_s = 0;       ///< time of motion; it does not pass while the robot stands
  double commanded_m = 0;    ///< along base x, after delay and lag of the motors
  double ramp_m_s = 0;       ///< sum of the changes of the commanded speed: what a wrong lag moves
  double commanded_rad = 0;  ///< turned, after lag of the motors, before slip
  double ramp_rad_s = 0;     ///< sum of the changes of the commanded yaw rate
  double wheels_m = 0;       ///< along base x
  double wheels_rad = 0;     ///< turned, by odometry
  double gyro_rad = 0;       ///< turned, by the gyro
  double path_m = 0;         ///< length of the way by the wheels
  double turned_rad = 0;     ///< sum of the turns to either side
  SE2 odom_T_base{};         ///< by wheels after the learnt scale, and gyro where there is one
  SE2 map_T_base{};          ///< by tags: the estimate, or the tags of one picture alone
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of its x, y [m] and yaw [rad]
  bool tags = false;  ///< the pose rests on a tag that was accepted a moment ago
};

/// How well the sources are known to agree.
struct MotionScales {
  bool gyro = false;             ///< the robot has one
  double distance_share = 0.02;  ///< uncertainty of the distance of the wheels, as a share
  double turn_share = 0.35;      ///< uncertainty of turns by odometry: the floor may change
  double turn_scale = 1;         ///< true turn over that of odometry
  double command_scale = 1;      ///< turn of the robot over the commanded one
  double command_share = 0.5;    ///< its uncertainty
  double sigmas = 2;             ///< deviations of a pose by tags that count as its uncertainty
};

/// Two sources that cannot both be right.
struct Contradiction {
  MotionSource one = MotionSource::Wheels;
  MotionSource other = MotionSource::Tags;
  bool turning = false;  ///< both motions are turns [rad], not ways [m]
  bool carried = false;  ///< moved by more than slip explains, within a moment
  double one_moved = 0;
  double other_moved = 0;
  double apart = 0;  ///< difference of both, as vectors
  double over_s = 0;
  double late_s = 0;  ///< turns of the other follow those of the one by this time; 0: that is not it
  std::optional<MotionSource> culprit{};  ///< where a third source decides
};

/// The first contradiction over the whole of the window, oldest sample first: two sources differ by more than
/// their limit beyond their uncertainty, and each third of the window holds a quarter of the difference or
/// more, so that a jump or a short slip does not count. Pure.
[[nodiscard]] std::optional<Contradiction> find_contradiction(const std::vector<MotionSample>& window,
                                                              const MotionScales& scales,
                                                              const ConsistencyOptions& options);

/// The same for poses that rest on the tags of one picture each: only what concerns tags.
[[nodiscard]] std::optional<Contradiction> find_tag_contradiction(const std::vector<MotionSample>& window,
                                                                  const MotionScales& scales,
                                                                  const ConsistencyOptions& options);

/// Whether the robot came farther between two moments than wheels that slip explain (its true way lies
/// between none and theirs), or turned by more than commands or wheels do: somebody carried or turned it.
/// Pure.
[[nodiscard]] std::optional<Contradiction> find_push(const MotionSample& before, const MotionSample& after,
                                                     const MotionScales& scales,
                                                     const ConsistencyOptions& options);

/// Whether tags and odometry differ over a standstill by more than their limit and their uncertainty:
/// somebody carried or turned the robot. Pure.
[[nodiscard]] std::optional<Contradiction> find_carry(const MotionSample& before, const MotionSample& after,
                                                      double stood_s, const ConsistencyOptions& options);

/// One sentence that names the pair.
[[nodiscard]] std::string to_words(const Contradiction& found);

/// What the sources said up to a sample of odometry.
struct StampedSums {
  SensorTime stamp{};
  MotionSample sums{};
};

/// Collects what the sources say, learns how the scales of odometry compare with tags and gyro (least squares
/// with forgetting, from motion that has left the window without a contradiction), and asks
/// find_contradiction(). A robot that stands is judged at its next motion. Poses by the tags of one picture
/// each are held against the other sources as well: wheels that slip do not move them as they move an
/// estimate.
class MotionConsistency {
 public:
  MotionConsistency(const ConsistencyOptions& options, const ActuatorOptions& actuators)
      : options_(options), actuators_(actuators) {}

  void add(const Odometry& odometry);
  void add(const ImuSample& imu);
  /// The command that acted since the last step.
  void command(const VelocityCommand& sent, double dt_s);
  /// The estimate of now; `tags`: a tag was accepted a moment ago.
  void observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags);
  /// A pose by the tags of one picture alone. `accepted`: the estimate follows them.
  void observe_picture(SensorTime stamp, const SE2& map_T_base, const Eigen::Matrix3d& covariance,
                       bool accepted);
  /// No estimate now.
  void observe_nothing();

  [[nodiscard]] std::optional<Contradiction> contradiction() const;
  [[nodiscard]] const std::deque<MotionSample>& samples() const { return samples_; }
  [[nodiscard]] double path_m() const { return now_.path_m; }
  [[nodiscard]] MotionScales scales() const;
  /// After a person looked: what was before is not held against what comes.
  void forget() {
    samples_.clear();
    carried_.reset();
    stood_s_ = 0;
    forget_pictures();
    headings_.clear();
    late_.reset();
  }

 private:
  void keep();
  void learn(const MotionSample& gone);
  [[nodiscard]] std::optional<MotionSample> sums_at(SensorTime stamp) const;
  [[nodiscard]] std::optional<Contradiction> contradiction_of_pictures() const;
  [[nodiscard]] std::optional<Contradiction> push_of_pictures() const;
  void forget_pictures();
  void add_heading(SensorTime stamp, double yaw_rad);
  void look_for_delay();

  ConsistencyOptions options_;
  ActuatorOptions actuators_;
  MotionSample now_{};
  std::deque<MotionSample> samples_;
  std::optional<Odometry> odometry_{};
  std::optional<SensorTime> imu_{};
  double motor_m_s_ = 0;
  double motor_rad_s_ = 0;
  double dt_s_ = 0;
  VelocityCommand commanded_{};
  bool estimated_ = false;
  double stood_s_ = 0;
  std::optional<Contradiction> carried_{};  ///< over the last standstill
  std::optional<MotionSample> learnt_to_{};
  double distance_scale_ = 1;
  double way_way_ = 0;
  double way_tags_ = 0;
  double turn_turn_ = 0;
  double turn_true_ = 0;
  double command_command_ = 0;
  double command_true_ = 0;
  std::deque<StampedSums> history_{};  ///< of odometry, oldest first
  std::vector<HeadingAt> headings_{};  ///< of pictures, since the first sample of odometry
  std::optional<Contradiction> late_{};
  std::optional<SensorTime> zero_{};     ///< of those times
  std::deque<MotionSample> pictures_{};  ///< poses by one picture each; moving_s is since picture_zero_
  SensorTime picture_zero_{};
  std::optional<Contradiction> suspected_{};  ///< by the newest picture …
  std::optional<Contradiction> pictured_{};   ///< … and by the one before it
};

}  // namespace waymark
