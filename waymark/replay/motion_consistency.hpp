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

/// Motion measured by each source, integrated up to one point in time. The origins of the sums and poses are
/// arbitrary; only differences are used.
struct MotionSample {
  double moving_s = 0;     ///< time in motion; does not advance during a standstill
  double commanded_m = 0;  ///< along base x, with the motors' delay and lag applied
  double ramp_m_s = 0;  ///< sum of the absolute changes in commanded speed; scales the effect of a wrong lag
  double commanded_rad = 0;  ///< turn after the motor lag, before slip
  double ramp_rad_s = 0;     ///< sum of the absolute changes in commanded yaw rate
  double wheels_m = 0;       ///< along base x
  double wheels_rad = 0;     ///< turn measured by odometry
  double gyro_rad = 0;       ///< turn measured by the gyro
  double gyro_s = 0;         ///< time over which gyro_rad was integrated, including standstills
  double path_m = 0;         ///< path length measured by the wheels
  double turned_rad = 0;     ///< sum of the absolute turns
  SE2 odom_T_base{};         ///< from the wheels with the learned scale, and from the gyro if there is one
  SE2 map_T_base{};          ///< from tags: either the estimate or the tags in one image alone
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of x, y [m] and yaw [rad] of map_T_base
  bool tags = false;                                     ///< whether the pose uses a recently accepted tag
};

/// Uncertainties used when comparing the sources.
struct MotionScales {
  bool gyro = false;             ///< whether the robot has a gyro
  double distance_share = 0.02;  ///< relative uncertainty of the distance measured by the wheels
  double turn_share = 0.35;      ///< relative uncertainty of turns measured by odometry; the floor may change
  double turn_noise_sqrt_m = 0;  ///< random walk of turns from odometry, in rad per square root of a metre
  double turn_scale = 1;         ///< ratio of the true turn to the turn from odometry
  double command_scale = 1;      ///< ratio of actual to commanded turn
  double command_share = 0.5;    ///< relative uncertainty of command_scale
  double sigmas = 2;  ///< number of standard deviations taken as the uncertainty of a pose from tags
};

/// A heading at one point in time, unwrapped.
struct HeadingAt {
  double time_s = 0;
  double yaw_rad = 0;
};

/// The camera latency for which headings from images best match those from odometry.
struct CameraLatencyFit {
  double camera_latency_s = 0;
  double rms_rad = 0;                  ///< RMS residual with this latency
  double rms_without_latency_rad = 0;  ///< RMS residual without any latency
};

/// Fits the camera latency, up to `max_latency_s`, for which scaled headings from odometry best match those
/// from images (least squares on a grid). `nullopt` if the turns are too uniform or another latency fits
/// nearly as well. Both inputs must be in time order. O(images log odometry). Pure.
[[nodiscard]] std::optional<CameraLatencyFit> find_camera_latency(std::span<const HeadingAt> images,
                                                                  std::span<const HeadingAt> odometry,
                                                                  double max_latency_s);

struct ConsistencyOptions {
  double window_s = 1.0;
  double contradiction_m = 0.05;
  double contradiction_rad = 0.0873;
  double pushed_m = 0.10;
  double pushed_rad = 0.2;
  double slipped_m = 0.15;
  double late_images_s = 0.2;  ///< limit for the camera latency found by find_camera_latency()

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
            "beyond the uncertainty: it was moved by hand.",
            0.01, 10});
    visit(self.pushed_rad, Field{"pushed_rad",
                                 "Stop when the robot turned by more within the window than its commands or "
                                 "wheels explain: it was moved by hand.",
                                 0.01, 6.3});
    visit(self.slipped_m,
          Field{"slipped_m",
                "Stop when the distances by wheels and by tags differ by more within the window, beyond the "
                "uncertainty. Slipping wheels may explain it, but the robot may have been carried back.",
                0.01, 10});
    visit(
        self.late_images_s,
        Field{
            "late_images_s",
            "Stop when turns observed with tags follow those of odometry by more than this time: images are "
            "stamped too late.",
            0.05, 10});
  }
};

enum class MotionSource : std::uint8_t { Commands, Wheels, Gyro, Tags };

/// Two sources that report inconsistent motions.
struct Contradiction {
  MotionSource one = MotionSource::Wheels;
  MotionSource other = MotionSource::Tags;
  bool turning = false;  ///< whether the motions are turns [rad] rather than distances [m]
  bool carried = false;  ///< whether the motion was sudden and cannot be explained by slip
  double one_moved = 0;
  double other_moved = 0;
  double apart = 0;  ///< norm of the difference vector
  double over_s = 0;
  double camera_latency_s = 0;  ///< lag of turns from `other` behind those from `one`; 0 if not the cause
  double repeats_s = 0;  ///< time for which `one` has repeated exactly the same value; 0 if not the cause
  std::optional<MotionSource> culprit{};  ///< the faulty source, as decided by a third one
};

/// The first contradiction over the whole window (oldest sample first). Two sources contradict each other if
/// they differ by more than their limit plus uncertainty. Each third of the window must contain at least a
/// quarter of the difference, so that a jump or a short slip does not count. Pure.
[[nodiscard]] std::optional<Contradiction> find_contradiction(const std::vector<MotionSample>& window,
                                                              const MotionScales& scales,
                                                              const ConsistencyOptions& options);

/// find_contradiction() for poses from single images, restricted to comparisons with tags.
[[nodiscard]] std::optional<Contradiction> find_tag_contradiction(const std::vector<MotionSample>& window,
                                                                  const MotionScales& scales,
                                                                  const ConsistencyOptions& options);

/// Detects a push between two points in time: the robot moved farther than slipping wheels can explain, or
/// turned more than the commands or wheels can explain. The actual motion of slipping wheels lies between
/// zero and the measured one; a robot that is slowly carried back looks the same. Pure.
[[nodiscard]] std::optional<Contradiction> find_push(const MotionSample& before, const MotionSample& after,
                                                     const MotionScales& scales,
                                                     const ConsistencyOptions& options);

/// Detects that the robot was moved during a standstill: tags and odometry differ by more than their limit
/// plus uncertainty. Pure.
[[nodiscard]] std::optional<Contradiction> find_carry(const MotionSample& before, const MotionSample& after,
                                                      double standstill_s, const ConsistencyOptions& options);

/// A sentence that names the two sources and the likely cause.
[[nodiscard]] std::string describe(const Contradiction& found);

/// A longer interval between two samples counts as a gap [s].
constexpr double kMotionGap_s = 0.3;

/// Prior for the odometry before the first motion, either from a calibration or for an unknown robot.
struct OdometryPrior {
  double distance_scale = 1;     ///< ratio of true to measured distance
  double distance_share = 0.06;  ///< relative uncertainty of distance_scale
  double turn_scale = 1;         ///< ratio of true to measured turn
  double turn_share = 0.8;       ///< relative uncertainty of turn_scale
  double turn_noise_sqrt_m = 0;  ///< random walk of the heading, in rad per square root of a metre
};

/// Reads "odometry_scale", "yaw_scale" and "yaw_noise_rad_sqrt_m"; missing values get defaults.
[[nodiscard]] OdometryPrior odometry_prior(const Calibration& calibration);

/// Motion sums at the time of an odometry sample.
struct StampedSums {
  SensorTime stamp{};
  MotionSample sums{};
};

/// Standstill as reported by observe().
struct Standing {
  bool at_standstill = false;  ///< stationary for longer than kMinStandstill_s
  /// A standstill that has ended, with the last sample before it, the first one after it, and its duration.
  struct Over {
    MotionSample before{};
    MotionSample after{};
    double standstill_s = 0;
  };
  std::optional<Over> over{};
};

/// Sums of the motion from commands, wheels and gyro, together with the poses from tags, sampled over the
/// most recent motion. Learns the scales of odometry relative to tags and gyro (least squares with
/// forgetting, from motion that has left the window without a contradiction). Standstills add nothing.
class MotionSums {
 public:
  /// Keeps the samples from the last `kept_s` of motion.
  MotionSums(const ActuatorOptions& actuators, const OdometryPrior& odometry, double kept_s)
      : actuators_(actuators),
        odometry_prior_(odometry),
        kept_s_(kept_s),
        distance_scale_(odometry.distance_scale) {}

  /// Returns false if all earlier samples were discarded because of a clock jump or a long gap.
  bool add(const Odometry& odometry);
  void add(const ImuSample& imu);
  /// Adds the command that has been in effect since the last step.
  void command(const VelocityCommand& sent, double dt_s);
  /// Adds the current estimate. `tags`: whether a tag was accepted recently.
  Standing observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags);
  /// To be called when there is no current estimate.
  Standing observe_nothing();

  [[nodiscard]] const std::deque<MotionSample>& samples() const { return samples_; }
  /// The sums up to the newest odometry sample, together with the newest estimate.
  [[nodiscard]] const MotionSample& now() const { return now_; }
  /// Sums at each odometry sample, oldest first.
  [[nodiscard]] const std::deque<StampedSums>& history() const { return history_; }
  /// The sums at a time between two odometry samples or just after the newest one.
  [[nodiscard]] std::optional<MotionSample> at(SensorTime stamp) const;
  [[nodiscard]] MotionScales scales() const;
  /// How long the gyro has repeated exactly the same value while another yaw rate was commanded; 0 if it has
  /// not.
  [[nodiscard]] double gyro_repeats_s() const;
  [[nodiscard]] double path_m() const { return now_.path_m; }
  /// Timestamp of the first odometry sample.
  [[nodiscard]] std::optional<SensorTime> zero() const { return zero_; }
  /// Discards the history, so that earlier motion is not compared with later motion.
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
  ImuSample repeated_{};    ///< the first of the newest samples that are all identical
  int repeats_ = 0;         ///< number of repetitions since then
  double ramp_before_ = 0;  ///< MotionSample::ramp_rad_s at the time of repeated_
  double motor_m_s_ = 0;
  double motor_rad_s_ = 0;
  double dt_s_ = 0;
  VelocityCommand commanded_{};
  bool estimated_ = false;
  double standstill_s_ = 0;
  std::optional<MotionSample> learnt_to_{};
  double distance_scale_;
  double way_way_ = 0;
  double way_tags_ = 0;
  double turn_turn_ = 0;
  double turn_true_ = 0;
  double command_command_ = 0;
  double command_true_ = 0;
};

/// Compares the sources using find_contradiction(). A standstill is evaluated when the robot next moves.
/// Poses from the tags in single images are also compared with the other sources, because slipping wheels do
/// not affect them as much as the estimate.
class MotionConsistency {
 public:
  MotionConsistency(const ConsistencyOptions& options, const ActuatorOptions& actuators,
                    const OdometryPrior& odometry = {});

  void add(const Odometry& odometry);
  void add(const ImuSample& imu) { sums_.add(imu); }
  /// Adds the command that has been in effect since the last step.
  void command(const VelocityCommand& sent, double dt_s) { sums_.command(sent, dt_s); }
  /// Adds the current estimate. `tags`: whether a tag was accepted recently.
  void observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags);
  /// Adds a pose from the tags in one image alone. `accepted`: whether the filter used these tags.
  void observe_image(SensorTime stamp, const SE2& map_T_base, const Eigen::Matrix3d& covariance,
                     bool accepted);
  /// To be called when there is no current estimate.
  void observe_nothing();

  [[nodiscard]] std::optional<Contradiction> contradiction() const;
  [[nodiscard]] double path_m() const { return sums_.path_m(); }
  [[nodiscard]] MotionScales scales() const { return sums_.scales(); }
  /// To be called once the driver has checked the robot. Earlier motion is then no longer compared with later
  /// motion.
  void forget();

 private:
  /// The pose from the tags in one image, and the estimate at that time.
  struct ImageEntry {
    MotionSample seen{};
    MotionSample estimated{};
  };
  using ImageIterator = std::deque<ImageEntry>::const_iterator;

  void notice_standstill(const Standing& standing);
  [[nodiscard]] std::optional<ImageIterator> image_before(double moving_s) const;
  [[nodiscard]] std::optional<Contradiction> contradiction_of_images() const;
  [[nodiscard]] std::optional<Contradiction> push_of_images() const;
  void forget_images();
  void add_heading(SensorTime stamp, double yaw_rad);
  void check_camera_latency();

  ConsistencyOptions options_;
  MotionSums sums_;
  std::optional<Contradiction> carried_{};  ///< carry during the last standstill
  std::vector<HeadingAt> headings_{};       ///< headings from images since the first odometry sample
  std::optional<Contradiction> latency_contradiction_{};
  std::deque<ImageEntry> images_{};  ///< moving_s counts from image_zero_
  SensorTime image_zero_{};
  std::optional<std::size_t> suspected_ago_{};  ///< number of images since the newest one that contradicts
  std::optional<Contradiction>
      contradiction_in_images_{};  ///< contradiction found in two of the newest images
};

}  // namespace waymark
