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

/// Motion by each source, integrated up to one time. The origins of sums and poses are arbitrary; only
/// differences are used.
struct MotionSample {
  double moving_s = 0;       ///< time of motion; it does not advance during a standstill
  double commanded_m = 0;    ///< along base x, after delay and lag of the motors
  double ramp_m_s = 0;       ///< sum of the changes of the commanded speed; scales the effect of a wrong lag
  double commanded_rad = 0;  ///< turn after the lag of the motors, before slip
  double ramp_rad_s = 0;     ///< sum of the changes of the commanded yaw rate
  double wheels_m = 0;       ///< along base x
  double wheels_rad = 0;     ///< turn by odometry
  double gyro_rad = 0;       ///< turn by the gyro
  double gyro_s = 0;         ///< time over which gyro_rad was summed, including standstills
  double path_m = 0;         ///< path length by the wheels
  double turned_rad = 0;     ///< sum of the absolute turns
  SE2 odom_T_base{};         ///< by wheels with the learned scale, and by the gyro if there is one
  SE2 map_T_base{};          ///< by tags: the estimate, or the tags of one image alone
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of its x, y [m] and yaw [rad]
  bool tags = false;                                     ///< the pose uses a recently accepted tag
};

/// Uncertainty of the comparison between the sources.
struct MotionScales {
  bool gyro = false;             ///< the robot has one
  double distance_share = 0.02;  ///< relative uncertainty of the distance by the wheels
  double turn_share = 0.35;      ///< relative uncertainty of turns by odometry; the floor may change
  double turn_noise_sqrt_m = 0;  ///< random walk of turns by odometry, rad per square root of a metre
  double turn_scale = 1;         ///< true turn over that of odometry
  double command_scale = 1;      ///< actual over commanded turn
  double command_share = 0.5;    ///< relative uncertainty of command_scale
  double sigmas = 2;             ///< standard deviations of a pose by tags that form its uncertainty
};

/// A heading at a time, unwrapped.
struct HeadingAt {
  double time_s = 0;
  double yaw_rad = 0;
};

/// The camera latency at which headings from images follow those of odometry best.
struct CameraLatencyFit {
  double camera_latency_s = 0;
  double rms_rad = 0;                  ///< of the residuals with this latency
  double rms_without_latency_rad = 0;  ///< and without any
};

/// Fits the camera latency, up to `max_latency_s`, with which scaled headings of odometry match those of
/// images (least squares on a grid). None if the turns are too uniform, or another latency fits nearly as
/// well. Both inputs must be in time order. O(images log odometry). Pure.
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
        self.late_pictures_s,
        Field{
            "late_pictures_s",
            "Stop when turns observed with tags follow those of odometry by more than this time: images are "
            "stamped too late.",
            0.05, 10});
  }
};

enum class MotionSource : std::uint8_t { Commands, Wheels, Gyro, Tags };

/// Two sources whose motions are inconsistent.
struct Contradiction {
  MotionSource one = MotionSource::Wheels;
  MotionSource other = MotionSource::Tags;
  bool turning = false;  ///< both motions are turns [rad] instead of distances [m]
  bool carried = false;  ///< a sudden motion that slip does not explain
  double one_moved = 0;
  double other_moved = 0;
  double apart = 0;  ///< norm of the vector difference
  double over_s = 0;
  double camera_latency_s = 0;  ///< turns of `other` follow those of `one` by this time; 0: not the cause
  double repeats_s = 0;  ///< time for which `one` has repeated the same value exactly; 0: not the cause
  std::optional<MotionSource> culprit{};  ///< decided by a third source
};

/// The first contradiction over the whole window (oldest sample first). Two sources contradict if they differ
/// by more than their limit plus uncertainty. Each third of the window must contain at least a quarter of the
/// difference, so that a jump or a short slip does not count. Pure.
[[nodiscard]] std::optional<Contradiction> find_contradiction(const std::vector<MotionSample>& window,
                                                              const MotionScales& scales,
                                                              const ConsistencyOptions& options);

/// find_contradiction() for poses from single images, limited to comparisons with tags.
[[nodiscard]] std::optional<Contradiction> find_tag_contradiction(const std::vector<MotionSample>& window,
                                                                  const MotionScales& scales,
                                                                  const ConsistencyOptions& options);

/// Detects a push between two times: the robot moved farther than slipping wheels explain, or turned more
/// than commands or wheels explain. The actual motion of slipping wheels is between zero and the measured
/// one; a robot that is carried back slowly looks the same. Pure.
[[nodiscard]] std::optional<Contradiction> find_push(const MotionSample& before, const MotionSample& after,
                                                     const MotionScales& scales,
                                                     const ConsistencyOptions& options);

/// Detects that the robot was moved during a standstill: tags and odometry differ by more than their limit
/// and uncertainty. Pure.
[[nodiscard]] std::optional<Contradiction> find_carry(const MotionSample& before, const MotionSample& after,
                                                      double standstill_s, const ConsistencyOptions& options);

/// A sentence that names the two sources and the likely cause.
[[nodiscard]] std::string describe(const Contradiction& found);

/// A longer interval between two samples is a gap [s].
constexpr double kMotionGap_s = 0.3;

/// Prior of the odometry before the first motion, for an unknown robot or from a calibration.
struct OdometryPrior {
  double distance_scale = 1;     ///< true distance over measured distance
  double distance_share = 0.06;  ///< relative uncertainty of distance_scale
  double turn_scale = 1;         ///< true turn over measured turn
  double turn_share = 0.8;       ///< relative uncertainty of turn_scale
  double turn_noise_sqrt_m = 0;  ///< random walk of the heading, rad per square root of a metre
};

/// Reads "odometry_scale", "yaw_scale" and "yaw_noise_rad_sqrt_m"; missing values get defaults.
[[nodiscard]] OdometryPrior odometry_prior(const Calibration& calibration);

/// Motion sums at an odometry sample.
struct StampedSums {
  SensorTime stamp{};
  MotionSample sums{};
};

/// Standstill as reported by observe().
struct Standing {
  bool at_standstill = false;  ///< longer than kMinStandstill_s
  /// A standstill that has ended: the last sample before it, the first after it, and its duration.
  struct Over {
    MotionSample before{};
    MotionSample after{};
    double standstill_s = 0;
  };
  std::optional<Over> over{};
};

/// Sums of motion by commands, wheels and gyro with the poses by tags, sampled over the last moments of
/// motion. Learns the scales of odometry relative to tags and gyro (least squares with forgetting, from
/// motion that has left the window without a contradiction). Standstills add nothing.
class MotionSums {
 public:
  /// Keeps the samples of the last `kept_s` of motion.
  MotionSums(const ActuatorOptions& actuators, const OdometryPrior& odometry, double kept_s)
      : actuators_(actuators),
        odometry_prior_(odometry),
        kept_s_(kept_s),
        distance_scale_(odometry.distance_scale) {}

  /// Returns false if all earlier samples were discarded because of a clock jump or a long gap.
  bool add(const Odometry& odometry);
  void add(const ImuSample& imu);
  /// Adds the command that acted since the last step.
  void command(const VelocityCommand& sent, double dt_s);
  /// Adds the current estimate; `tags`: a tag was accepted recently.
  Standing observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags);
  /// To be called if there is no current estimate.
  Standing observe_nothing();

  [[nodiscard]] const std::deque<MotionSample>& samples() const { return samples_; }
  /// The sums up to the newest odometry sample, with the newest estimate.
  [[nodiscard]] const MotionSample& now() const { return now_; }
  /// Sums per odometry sample, oldest first.
  [[nodiscard]] const std::deque<StampedSums>& history() const { return history_; }
  /// The sums at a time between two odometry samples, or just after the newest.
  [[nodiscard]] std::optional<MotionSample> at(SensorTime stamp) const;
  [[nodiscard]] MotionScales scales() const;
  /// Time for which the gyro has repeated exactly the same value while another yaw rate was commanded; 0 if
  /// it has not.
  [[nodiscard]] double gyro_repeats_s() const;
  [[nodiscard]] double path_m() const { return now_.path_m; }
  /// Stamp of the first odometry sample.
  [[nodiscard]] std::optional<SensorTime> zero() const { return zero_; }
  /// Discards the history: earlier motion is not compared with later motion.
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
  ImuSample repeated_{};    ///< first of the identical newest samples
  int repeats_ = 0;         ///< number of repetitions since
  double ramp_before_ = 0;  ///< MotionSample::ramp_rad_s at its time
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

/// Compares the sources with find_contradiction(). A standstill is evaluated at the next motion. Poses from
/// the tags of single images are compared with the other sources as well, because slipping wheels do not
/// affect them as they affect the estimate.
class MotionConsistency {
 public:
  MotionConsistency(const ConsistencyOptions& options, const ActuatorOptions& actuators,
                    const OdometryPrior& odometry = {});

  void add(const Odometry& odometry);
  void add(const ImuSample& imu) { sums_.add(imu); }
  /// Adds the command that acted since the last step.
  void command(const VelocityCommand& sent, double dt_s) { sums_.command(sent, dt_s); }
  /// Adds the current estimate; `tags`: a tag was accepted recently.
  void observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags);
  /// Adds a pose from the tags of one image alone. `accepted`: whether the filter used these tags.
  void observe_picture(SensorTime stamp, const SE2& map_T_base, const Eigen::Matrix3d& covariance,
                       bool accepted);
  /// To be called if there is no current estimate.
  void observe_nothing();

  [[nodiscard]] std::optional<Contradiction> contradiction() const;
  [[nodiscard]] double path_m() const { return sums_.path_m(); }
  [[nodiscard]] MotionScales scales() const { return sums_.scales(); }
  /// Call after the driver checked the robot. Earlier motion is then not compared with later motion.
  void forget();

 private:
  /// The pose from the tags of one image, and the estimate at that time.
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
  void check_camera_latency();

  ConsistencyOptions options_;
  MotionSums sums_;
  std::optional<Contradiction> carried_{};  ///< during the last standstill
  std::vector<HeadingAt> headings_{};       ///< from images, since the first odometry sample
  std::optional<Contradiction> latency_contradiction_{};
  std::deque<Picture> pictures_{};  ///< moving_s is since picture_zero_
  SensorTime picture_zero_{};
  std::optional<std::size_t> suspected_ago_{};  ///< number of images since the newest contradicting one
  std::optional<Contradiction> pictured_{};     ///< found in two of the newest images
};

}  // namespace waymark
