#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/fields.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/replay/motion_predictor.hpp"
#include "waymark/samples/calibration.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

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
  double gyro_s = 0;         ///< time over which that was summed, standing too
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
  double turn_noise_sqrt_m = 0;  ///< random walk of turns by odometry, rad per square root of a metre
  double turn_scale = 1;         ///< true turn over that of odometry
  double command_scale = 1;      ///< turn of the robot over the commanded one
  double command_share = 0.5;    ///< its uncertainty
  double sigmas = 2;             ///< deviations of a pose by tags that count as its uncertainty
};

/// A heading at a moment; turns are counted on, not wrapped.
struct HeadingAt {
  double time_s = 0;
  double yaw_rad = 0;
};

/// The camera latency by which headings seen in pictures follow those of odometry best.
struct CameraLatencyFit {
  double camera_latency_s = 0;
  double rms_rad = 0;                  ///< of the residuals with this latency
  double rms_without_latency_rad = 0;  ///< and without any
};

/// The camera latency, up to `max_latency_s`, with which scale times the headings of odometry fit those of
/// pictures best (least squares on a grid). Nothing when the turns are too even to tell, or another latency
/// fits nearly as well. Both in order of time. O(pictures log odometry). Pure.
[[nodiscard]] std::optional<CameraLatencyFit> find_camera_latency(std::span<const HeadingAt> pictures,
                                                                  std::span<const HeadingAt> odometry,
                                                                  double max_latency_s);

struct ConsistencyOptions {
  double window_s = 1.0;
  double contradiction_m = 0.05;
  double contradiction_rad = 0.0873;
  double pushed_m = 0.10;
  double pushed_rad = 0.2;
  double slipped_m = 0.15;
  double late_pictures_s = 0.2;  ///< limit of the camera latency that find_camera_latency() finds

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
    visit(self.slipped_m,
          Field{"slipped_m",
                "Stop when the ways by wheels and by tags differ by more within the window, beyond the "
                "uncertainty, even if slipping wheels explain it: the robot may have been carried back.",
                0.01, 10});
    visit(self.late_pictures_s,
          Field{"late_pictures_s",
                "Stop when turns seen by tags follow those of odometry by more than this time: pictures are "
                "stamped late.",
                0.05, 10});
  }
};

enum class MotionSource : std::uint8_t { Commands, Wheels, Gyro, Tags };

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
  double camera_latency_s =
      0;                 ///< turns of the other follow those of the one by this time; 0: that is not it
  double repeats_s = 0;  ///< so long the one has repeated itself to the last bit; 0: that is not it
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
/// between none and theirs, and not far from theirs: nobody can tell slipping wheels from a robot that is
/// carried back meanwhile), or turned by more than commands or wheels do: somebody carried or turned it.
/// Pure.
[[nodiscard]] std::optional<Contradiction> find_push(const MotionSample& before, const MotionSample& after,
                                                     const MotionScales& scales,
                                                     const ConsistencyOptions& options);

/// Whether tags and odometry differ over a standstill by more than their limit and their uncertainty:
/// somebody carried or turned the robot. Pure.
[[nodiscard]] std::optional<Contradiction> find_carry(const MotionSample& before, const MotionSample& after,
                                                      double stood_s, const ConsistencyOptions& options);

/// One sentence that names the pair.
[[nodiscard]] std::string describe(const Contradiction& found);

/// Two samples this far apart have a gap between them [s].
constexpr double kMotionGap_s = 0.3;

/// What is known of the robot's odometry before it moves: that of an unknown robot, or what a calibration
/// says.
struct OdometryPrior {
  double distance_scale = 1;     ///< true distance over that of odometry
  double distance_share = 0.06;  ///< its uncertainty
  double turn_scale = 1;         ///< true turn over that of odometry
  double turn_share = 0.8;       ///< its uncertainty, as a share of the turn
  double turn_noise_sqrt_m = 0;  ///< random walk of the heading, rad per square root of a metre
};

/// By "odometry_scale", "yaw_gain" and "yaw_noise_rad_sqrt_m"; what the calibration does not know stays.
[[nodiscard]] OdometryPrior odometry_prior(const Calibration& calibration);

/// What the sources said up to a sample of odometry.
struct StampedSums {
  SensorTime stamp{};
  MotionSample sums{};
};

/// What observe() found about standing.
struct Standing {
  bool stands = false;  ///< for a moment already
  /// Of a standstill that is over: the last sample before it, what the sources say now, and how long it was.
  struct Over {
    MotionSample before{};
    MotionSample after{};
    double stood_s = 0;
  };
  std::optional<Over> over{};
};

/// Sums of what commands, wheels and gyro say beside the poses by tags, as samples of the last moments of
/// motion. Learns how the scales of odometry compare with tags and gyro (least squares with forgetting, from
/// motion that has left the window without a contradiction). Standing adds nothing.
class MotionSums {
 public:
  /// Keeps the samples of `kept_s` of motion.
  MotionSums(const ActuatorOptions& actuators, const OdometryPrior& odometry, double kept_s)
      : actuators_(actuators),
        odometry_prior_(odometry),
        kept_s_(kept_s),
        distance_scale_(odometry.distance_scale) {}

  /// False when all before it was forgotten: another clock, or a gap that nobody can bridge.
  bool add(const Odometry& odometry);
  void add(const ImuSample& imu);
  /// The command that acted since the last step.
  void command(const VelocityCommand& sent, double dt_s);
  /// The estimate of now; `tags`: a tag was accepted a moment ago.
  Standing observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags);
  /// No estimate now.
  Standing observe_nothing();

  [[nodiscard]] const std::deque<MotionSample>& samples() const { return samples_; }
  /// The sums up to the newest sample of odometry, and the newest estimate.
  [[nodiscard]] const MotionSample& now() const { return now_; }
  /// Of odometry, oldest first.
  [[nodiscard]] const std::deque<StampedSums>& history() const { return history_; }
  /// The sums at a moment that lies between two samples of odometry, or just after the newest.
  [[nodiscard]] std::optional<MotionSample> at(SensorTime stamp) const;
  [[nodiscard]] MotionScales scales() const;
  /// How long the gyro has said the same, to the last bit, while the robot was asked to turn otherwise; 0: it
  /// has not.
  [[nodiscard]] double gyro_repeats_s() const;
  [[nodiscard]] double path_m() const { return now_.path_m; }
  /// Of the first sample of odometry.
  [[nodiscard]] std::optional<SensorTime> zero() const { return zero_; }
  /// What was before is not held against what comes.
  void forget();

 private:
  Standing keep();
  void learn(const MotionSample& gone);

  ActuatorOptions actuators_;
  OdometryPrior odometry_prior_;
  double kept_s_;
  MotionSample now_{};
  std::deque<MotionSample> samples_;
  std::deque<StampedSums> history_;
  std::optional<SensorTime> zero_{};
  std::optional<Odometry> odometry_{};
  std::optional<SensorTime> imu_{};
  ImuSample repeated_{};    ///< the first sample of those that say the same as the newest
  int repeats_ = 0;         ///< of it since
  double ramp_before_ = 0;  ///< MotionSample::ramp_rad_s at that time
  double motor_m_s_ = 0;
  double motor_rad_s_ = 0;
  double dt_s_ = 0;
  VelocityCommand commanded_{};
  bool estimated_ = false;
  double stood_s_ = 0;
  std::optional<MotionSample> learnt_to_{};
  double distance_scale_;
  double way_way_ = 0;
  double way_tags_ = 0;
  double turn_turn_ = 0;
  double turn_true_ = 0;
  double command_command_ = 0;
  double command_true_ = 0;
};

/// Holds what the sources say against each other, by find_contradiction(). A robot that stands is judged at
/// its next motion. Poses by the tags of one picture each are held against the other sources as well: wheels
/// that slip do not move them as they move an estimate.
class MotionConsistency {
 public:
  MotionConsistency(const ConsistencyOptions& options, const ActuatorOptions& actuators,
                    const OdometryPrior& odometry = {});

  void add(const Odometry& odometry);
  void add(const ImuSample& imu) { sums_.add(imu); }
  /// The command that acted since the last step.
  void command(const VelocityCommand& sent, double dt_s) { sums_.command(sent, dt_s); }
  /// The estimate of now; `tags`: a tag was accepted a moment ago.
  void observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags);
  /// A pose by the tags of one picture alone. `accepted`: the estimate follows them.
  void observe_picture(SensorTime stamp, const SE2& map_T_base, const Eigen::Matrix3d& covariance,
                       bool accepted);
  /// No estimate now.
  void observe_nothing();

  [[nodiscard]] std::optional<Contradiction> contradiction() const;
  [[nodiscard]] double path_m() const { return sums_.path_m(); }
  [[nodiscard]] MotionScales scales() const { return sums_.scales(); }
  /// After a person looked: what was before is not held against what comes.
  void forget();

 private:
  /// The pose by the tags of one picture, and the estimate of the same moment.
  struct Picture {
    MotionSample seen{};
    MotionSample estimated{};
  };
  using PictureIterator = std::deque<Picture>::const_iterator;

  void notice_standstill(const Standing& standing);
  [[nodiscard]] std::optional<PictureIterator> picture_before(double moving_s) const;
  [[nodiscard]] std::optional<Contradiction> contradiction_of_pictures() const;
  [[nodiscard]] std::optional<Contradiction> push_of_pictures() const;
  void forget_pictures();
  void add_heading(SensorTime stamp, double yaw_rad);
  void look_for_camera_latency();

  ConsistencyOptions options_;
  MotionSums sums_;
  std::optional<Contradiction> carried_{};  ///< over the last standstill
  std::vector<HeadingAt> headings_{};       ///< of pictures, since the first sample of odometry
  std::optional<Contradiction> latency_contradiction_{};
  std::deque<Picture> pictures_{};  ///< moving_s is since picture_zero_
  SensorTime picture_zero_{};
  std::optional<std::size_t> suspected_ago_{};  ///< pictures since the newest that contradicted
  std::optional<Contradiction> pictured_{};     ///< by two of the newest pictures
};

}  // namespace waymark
