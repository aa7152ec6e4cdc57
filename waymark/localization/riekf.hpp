#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/fields.hpp"
#include "waymark/geometry/se2.hpp"

/// The propagation and update of the filter, called by RiekfLocalizer and Tracker. Numbers in brackets refer
/// to the equations in docs/concepts/localization.md.
namespace waymark {

/// Noise of the measured motion. All values are densities: they are multiplied by the distance, rotation or
/// duration of a step, so the result does not depend on the sample rate.
struct MotionNoise {
  double along_m_sqrt_m = 0.01;
  double across_m_sqrt_m = 0.01;
  double yaw_rad_sqrt_m = 0.005;
  double yaw_rad_sqrt_rad = 0.01;
  double yaw_rad_sqrt_s = 0.001;
  double wheel_yaw_rad_sqrt_m = 0;
  double drift_m_sqrt_s = 0.0002;
  double slide_m_s = 0;
  double slide_time_s = 0.05;
  double distance_scale_sigma = 0.03;
  double yaw_scale_sigma = 0.03;
  double yaw_bias_sigma_rad_s = 0.005;
  double slip_sigma_s = 0.03;
  double crab_sigma_rad = 0;
  double crab_share = 0;
  double slow_time_s = 300;
  double slip_share = 1;
  /// Not a setting of the robot. If an observation divides an odometry message, the errors of the parts are
  /// treated as independent, so that the covariance does not depend on where the message is divided. This is
  /// for a search for the latency, which compares runs that differ only in this respect.
  bool independent_parts = false;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.along_m_sqrt_m,
          Field{"along_m_sqrt_m", "Noise of the driven distance, m per square root of a metre.", 0, 10});
    visit(self.across_m_sqrt_m,
          Field{"across_m_sqrt_m", "Lateral noise of the motion, m per square root of a metre.", 0, 10});
    visit(self.yaw_rad_sqrt_m,
          Field{"yaw_rad_sqrt_m", "Heading noise of driving, rad per square root of a metre.", 0, 10});
    visit(self.yaw_rad_sqrt_rad,
          Field{"yaw_rad_sqrt_rad", "Heading noise of turning, rad per square root of a radian.", 0, 10});
    visit(self.yaw_rad_sqrt_s,
          Field{"yaw_rad_sqrt_s", "Heading noise while moving, rad per square root of a second.", 0, 10});
    visit(self.wheel_yaw_rad_sqrt_m,
          Field{"wheel_yaw_rad_sqrt_m",
                "Additional heading noise of driving if the rotation is from odometry instead of a gyro, rad "
                "per square root of a metre.",
                0, 10});
    visit(self.drift_m_sqrt_s,
          Field{"drift_m_sqrt_s", "Noise of x and y at rest and in motion, m per square root of a second.", 0,
                10});
    visit(
        self.slide_m_s,
        Field{"slide_m_s",
              "Standard deviation of a time-correlated lateral velocity while the robot moves, m/s; 0: none.",
              0, 1});
    visit(self.slide_time_s, Field{"slide_time_s", "Correlation time of the lateral velocity, s.", 1e-3, 10});
    visit(self.distance_scale_sigma,
          Field{"distance_scale_sigma", "Standard deviation of the odometry scale; 0: it is exact.", 0, 1});
    visit(self.yaw_scale_sigma,
          Field{"yaw_scale_sigma", "Standard deviation of the yaw scale; 0: it is exact.", 0, 1});
    visit(self.yaw_bias_sigma_rad_s,
          Field{"yaw_bias_sigma_rad_s", "Standard deviation of the bias of the yaw rate; 0: there is none.",
                0, 1});
    visit(self.slip_sigma_s, Field{"slip_sigma_s",
                                   "Standard deviation of the lateral slip (lateral velocity per speed and "
                                   "yaw rate); 0: there is none.",
                                   0, 1});
    visit(
        self.crab_sigma_rad,
        Field{"crab_sigma_rad",
              "Standard deviation of the angle between the odometry's direction of motion and the robot's "
              "heading; 0: there is none. For odometry whose heading error does not rotate its translation.",
              0, 1});
    visit(self.crab_share,
          Field{"crab_share",
                "Share of the heading noise that does not rotate the translation; 1: odometry of some "
                "simulators, whose heading error leaves the translation unrotated.",
                0, 1});
    visit(
        self.slow_time_s,
        Field{"slow_time_s", "Time constant of the bias states (scales, biases, slip, crab angle).", 1, 1e9});
    visit(self.slip_share, Field{"slip_share",
                                 "Share of the disagreement between gyro and wheels in turning that is added "
                                 "to the noise of the motion.",
                                 0, 10});
  }
};

/// Options for the filters. The right-invariant filter and the plain EKF differ only in their error
/// coordinates.
struct RiekfOptions {
  MotionNoise motion{};
  /// Used for corners without a covariance (like TagPoseOptions::corner_sigma_px). It determines their weight
  /// relative to the predicted pose. corner_noise_ratio scales both this value and the covariances of
  /// detections.
  double corner_sigma_px = 0.3;
  double corner_noise_ratio = 1;
  double tag_sigma_m = 0.002;
  double tag_sigma_rad = 0.003;
  double tag_time_s = 30;
  double mounting_sigma_m = 0.001;
  double mounting_sigma_rad = 0.002;
  double farthest_m = 0;
  double gate = 0.9999;
  double uncertain_after_s = 0.3;
  double certain_sigma_m = 0.5;
  double camera_latency_s = 0;
  double camera_readout_s = 0;
  double point_sigma_m = 0.03;
  double point_sigma_share = 0.01;
  double range_sigma_m = 0.03;
  double bearing_sigma_rad = 0.026;
  std::string rotation = "auto";
  double odometry_scale = 1;
  double yaw_scale = 1;
  double gyro_gain = 1;
  double gyro_bias_rad_s = 0;
  double sight_scale = 1;
  double lag_s = 0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.motion, Field{"motion", "Noise of the measured motion."});
    visit(self.corner_sigma_px,
          Field{"corner_sigma_px", "Standard deviation of corners without a covariance, px.", 1e-3, 100});
    visit(self.corner_noise_ratio,
          Field{"corner_noise_ratio", "Scale on the standard deviation of corners.", 0.1, 100});
    visit(self.tag_sigma_m, Field{"tag_sigma_m",
                                  "Standard deviation of a lasting position error of each tag, beyond the "
                                  "covariance in the map; repeated observations do not average it away.",
                                  0, 10});
    visit(self.tag_sigma_rad, Field{"tag_sigma_rad",
                                    "Standard deviation of a lasting orientation error of each tag, beyond "
                                    "the covariance in the map.",
                                    0, 3});
    visit(self.tag_time_s, Field{"tag_time_s", "Correlation time of the lasting errors of tags.", 1e-3, 1e9});
    visit(self.mounting_sigma_m,
          Field{"mounting_sigma_m", "Standard deviation of the position of the camera on the robot.", 0, 1});
    visit(self.mounting_sigma_rad,
          Field{"mounting_sigma_rad", "Standard deviation of the orientation of the camera on the robot.", 0,
                1});
    visit(self.farthest_m,
          Field{"farthest_m", "Maximum distance of tags and landmarks that are used; 0: no limit.", 0});
    visit(
        self.gate,
        Field{"gate",
              "Probability of the chi-square gate: an observation less likely than 1 minus this is rejected.",
              0.5, 1 - 1e-9});
    visit(
        self.uncertain_after_s,
        Field{"uncertain_after_s",
              "Time for which all observations may be rejected before the estimate is declared inconsistent.",
              0, 60});
    visit(self.certain_sigma_m,
          Field{"certain_sigma_m",
                "Standard deviation of the position above which the estimate is reported as uncertain.", 1e-3,
                100});
    visit(
        self.camera_latency_s,
        Field{"camera_latency_s", "Camera latency: time from the exposure to the stamp of a frame.", -1, 1});
    visit(
        self.camera_readout_s,
        Field{
            "camera_readout_s",
            "Time from the first row to the last of a rolling shutter, negative when rows are read from the "
            "bottom; stamps are the middle row's; 0: global shutter.",
            -0.2, 0.2});
    visit(self.point_sigma_m,
          Field{"point_sigma_m",
                "Standard deviation of the floor position of tags without corners in the log.", 1e-4, 10});
    visit(
        self.point_sigma_share,
        Field{
            "point_sigma_share",
            "Standard deviation of the floor position of tags without corners, as a share of their distance.",
            0, 1});
    visit(self.range_sigma_m, Field{"range_sigma_m", "Standard deviation of measured ranges.", 1e-4, 10});
    visit(self.bearing_sigma_rad,
          Field{"bearing_sigma_rad", "Standard deviation of measured bearings.", 1e-5, 3});
    visit(self.rotation,
          Field{"rotation", "Source of the rotation: odometry, gyro, or auto (the gyro if there is one)."});
    visit(self.odometry_scale,
          Field{"odometry_scale", "Odometry scale from calibration: true distance over measured distance.",
                0.1, 10});
    visit(
        self.yaw_scale,
        Field{"yaw_scale",
              "Yaw scale of the odometry from calibration: true rotation over measured rotation.", 0.1, 10});
    visit(self.gyro_gain,
          Field{"gyro_gain", "Scale of the gyro from calibration: true rotation over measured rotation.", 0.1,
                10});
    visit(self.gyro_bias_rad_s,
          Field{"gyro_bias_rad_s", "Bias of the gyro at rest from calibration.", -10, 10});
    visit(self.sight_scale, Field{"sight_scale",
                                  "Scale of the distance of tags without corners from calibration: true "
                                  "distance over measured distance.",
                                  0.1, 10});
    visit(self.lag_s,
          Field{"lag_s",
                "Delay of the fixed-lag smoother (method smoother); 0: the whole recording is smoothed.", 0,
                10});
  }
};

using SlowVector = Eigen::Matrix<double, 5, 1>;
using StateVector = Eigen::Matrix<double, 8, 1>;
using StateMatrix = Eigen::Matrix<double, 8, 8>;
using StateByMotion = Eigen::Matrix<double, 8, 4>;

/// Number of parameters that a filter assumes to be exact. First comes the mounting of the sensor (left
/// tangent in base: x, y, z, roll, pitch, yaw). It is followed by the logarithm of the sensor's scale (focal
/// length, or scale of distances), its latency [s], and the odometry scales for distance and yaw.
inline constexpr int kSystematic = 10;
using SystematicVector = Eigen::Matrix<double, kSystematic, 1>;
using SystematicMatrix = Eigen::Matrix<double, kSystematic, kSystematic>;
using StateBySystematic = Eigen::Matrix<double, 8, kSystematic>;

/// Error coordinates: (1) X = Exp(xi) Xhat, or (12) differences of x, y and yaw.
enum class ErrorState : std::uint8_t { RightInvariant, Coordinates };

/// A measured motion along base axes, with a constant twist over dt.
struct MotionStep {
  Eigen::Vector3d twist = Eigen::Vector3d::Zero();  ///< log of the motion: x, y [m], yaw [rad]
  double dt_s = 0;
  double yaw_disagreement_rad = 0;  ///< difference between the turns measured by gyro and wheels
  bool standing = false;            ///< at standstill, when twist.z() is the gyro reading
  bool jumped = false;              ///< moved to an unknown pose; the twist is invalid
  double extra_m2 = 0;  ///< additional variance of x and y, and of the heading, if the motion is extrapolated
  double extra_rad2 = 0;
  double share = 1;        ///< share of its message, if an observation divides it
  bool continues = false;  ///< whether this is not the first part of its message
};

/// The residual (predicted minus measured) of one observation and its derivatives, whitened and linearised at
/// the estimate. Rows beyond `rows` are unused.
struct Linearised {
  int landmark = 0;
  int rows = 0;
  Eigen::Matrix<double, 8, 1> residual = Eigen::Matrix<double, 8, 1>::Zero();
  Eigen::Matrix<double, 8, 3> H_pose = Eigen::Matrix<double, 8, 3>::Zero();  ///< with respect to xi in (1)
  Eigen::Matrix<double, 8, 6> H_mount =
      Eigen::Matrix<double, 8,
                    6>::Zero();  ///< with respect to the mounting of the sensor (left tangent in base)
  Eigen::Matrix<double, 8, 6> H_tag =
      Eigen::Matrix<double, 8,
                    6>::Zero();  ///< with respect to (position along map axes, rotation about its own centre)
  Eigen::Matrix<double, 8, 1> H_scale =
      Eigen::Matrix<double, 8, 1>::Zero();  ///< with respect to the logarithm of the sensor's scale
};

/// The state of the filter with its covariances.
struct RiekfState {
  SE2 map_T_base{};
  SlowVector slow =
      SlowVector::Zero();  ///< distance scale - 1, yaw scale - 1, yaw bias [rad/s], slip [s], crab [rad]
  StateMatrix P = StateMatrix::Zero();  ///< covariance of (xi, slow)
  /// 8 x 6(1 + landmarks): covariance between the state and the considered errors of the mounting and of each
  /// landmark.
  Eigen::Matrix<double, 8, Eigen::Dynamic> C{};
  /// Covariance between the state and the error of the current motion message (its twist) and the sliding
  /// velocity.
  StateByMotion motion = StateByMotion::Zero();
  /// d(error) / d(errors of the parameters in kSystematic): how much each of them moves the estimate.
  StateBySystematic by_systematic = StateBySystematic::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< in base, during the last step [m/s, rad/s]
  /// 1 for landmarks that have been observed; for all others, their part of C is zero.
  std::vector<std::uint8_t> met{};
};

/// Right-invariant EKF on SE(2), with slow states for the motion. Errors of the mounting and of each landmark
/// are considered but not estimated (Schmidt, "Application of State-Space Methods to Navigation Problems",
/// 1966). Follows Barrau and Bonnabel, "The Invariant Extended Kalman Filter as a Stable Observer", IEEE TAC
/// 62(4), 2017. Does not allocate after construction.
class Riekf {
 public:
  static constexpr int kMaxBatch = 8;  ///< maximum number of observations in one update
  using Batch = std::array<Linearised, kMaxBatch>;

  Riekf(const RiekfOptions& options, ErrorState error,
        const std::vector<Eigen::Matrix<double, 6, 6>>& landmarks);

  /// Starts at a pose with the given covariance of xi (left tangent in map). Keeps the slow states if
  /// `keep_slow` is set.
  void start(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool keep_slow);
  /// Accounts for a start pose that was computed from these observations. Such a pose already contains the
  /// effect of errors of the parameters in kSystematic, so the residuals show little of them.
  void start_moved_by_systematic(const Batch& batch, int count);
  /// Propagates the state through a motion, (4) to (6), (19), (20). O(landmarks).
  void propagate(const MotionStep& step);
  /// Squared Mahalanobis distance between an observation and its prediction, (9). For a consistent filter, it
  /// follows a chi-square distribution with `rows` degrees of freedom. `place` is the index of the
  /// observation in the batch if it is used.
  [[nodiscard]] double nis(const Linearised& z, int place = 0);
  /// Computes the correction, (8) to (11), for the first `count` observations of a batch, all linearised at
  /// the state `offset` away from the current one. A non-zero offset is for an iterated update. Does not
  /// apply the correction. `expected` means that nis() has been called for each of them at its place since
  /// the state last changed, and need not be repeated.
  [[nodiscard]] StateVector gain(const Batch& batch, int count, const Eigen::Vector3d& offset,
                                 bool expected = false);
  /// Applies the correction computed by the last gain() together with its covariance, (10), (11).
  void correct(const Batch& batch, int count, const StateVector& correction);
  /// The state as it is after this correction.
  [[nodiscard]] SE2 corrected(const StateVector& correction) const;

  [[nodiscard]] const RiekfState& state() const { return state_; }
  void set_state(const RiekfState& state) { state_ = state; }
  /// Zero-velocity update: at standstill, a measured yaw rate equals its bias, (7).
  void observe_zero_velocity(double yaw_rate_rad_s, double sigma_rad_s);
  /// Covariance of xi in the left tangent, regardless of the error coordinates.
  [[nodiscard]] Eigen::Matrix3d covariance() const;
  /// Logarithm of the determinant of S in the last nis().
  [[nodiscard]] double log_det() const { return log_det_; }
  /// S in the last nis() for this place.
  [[nodiscard]] const Eigen::Matrix<double, 8, 8>& innovation_covariance(int place) const {
    return S_[index_of(place, place)];
  }
  /// Effect of errors of the parameters in kSystematic on the residual of an observation, including their
  /// effect on the estimate so far.
  [[nodiscard]] StateBySystematic sensitivity(const Linearised& z) const;
  /// Covariance of xi, in the left tangent, that is added if those parameters have errors with this
  /// covariance.
  [[nodiscard]] Eigen::Matrix3d covariance_of(const SystematicMatrix& errors) const;
  /// Conditional covariance of the state given the considered errors (of mounting and landmarks).
  [[nodiscard]] StateMatrix conditional_covariance() const;
  /// d(error after) / d(error before) for the last propagate().
  [[nodiscard]] const StateMatrix& last_transition() const { return transition_; }
  /// Additional cross-covariance between the states after and before the step, due to errors of the motion
  /// that last longer than a step.
  [[nodiscard]] StateMatrix last_motion_cross_covariance() const {
    return moved_by_.lazyProduct(motion_before_.transpose());
  }

 private:
  using Block = Eigen::Matrix<double, 8, 8>;
  /// The contribution of an observation to the covariance of the innovation: block (a, b) is left(a) times
  /// right(b), (9).
  struct Reach {
    Block cross;                         ///< covariance between state and residual: P H' + C N'
    Eigen::Matrix<double, 8, 12> left;   ///< H, M, T C_t'
    Eigen::Matrix<double, 12, 8> right;  ///< pose rows of cross; errors of M; H'
  };
  [[nodiscard]] Eigen::Matrix3d to_error() const;  ///< d xi / d error
  [[nodiscard]] Reach reach(const Linearised& z) const;
  [[nodiscard]] Block innovation(const Linearised& a, const Reach& of_a, const Linearised& b,
                                 const Reach& of_b) const;
  [[nodiscard]] Eigen::Matrix<double, 8, 3> H_of(const Linearised& z) const;
  [[nodiscard]] Eigen::Matrix<double, 8, 1> H_camera_latency(const Linearised& z) const;
  [[nodiscard]] auto block(int landmark) const {
    return state_.C.middleCols<6>(6 * (Eigen::Index{landmark} + 1));
  }
  [[nodiscard]] auto block(int landmark) { return state_.C.middleCols<6>(6 * (Eigen::Index{landmark} + 1)); }
  void expect(const Linearised& z, int place);
  [[nodiscard]] bool factorize(int count);
  [[nodiscard]] static std::size_t index_of(int i, int j) {
    return static_cast<std::size_t>(kMaxBatch) * static_cast<std::size_t>(i) + static_cast<std::size_t>(j);
  }
  [[nodiscard]] Block& S(int i, int j) { return S_[index_of(i, j)]; }
  void add_motion_noise(const MotionStep& step, const Eigen::Matrix3d& G, StateMatrix& P);
  void carry_correlations(const SlowVector& slow_fade, double landmarks_fade);
  void correct_correlations(const Batch& batch, int count);

  MotionNoise noise_;
  double landmark_time_s_;
  ErrorState error_;
  Eigen::Matrix<double, 6, 1> mount_;  ///< variances
  std::vector<Eigen::Matrix<double, 6, 6>> landmarks_;
  RiekfState state_;
  std::array<Reach, kMaxBatch> reach_;
  std::array<Block, std::size_t{kMaxBatch} * kMaxBatch>
      S_;                           ///< lower triangle by blocks, which is replaced with its factor L
  std::array<Block, kMaxBatch> W_;  ///< L^-1 (P H' + C N')'
  std::array<Eigen::Matrix<double, 8, 1>, kMaxBatch> y_;  ///< L^-1 r
  double log_det_ = 0;
  bool sound_ = false;  ///< whether S could be factorised
  StateMatrix transition_ = StateMatrix::Identity();
  StateByMotion moved_by_ = StateByMotion::Zero();  ///< d(error after) / d(errors of motion)
  StateByMotion motion_before_ = StateByMotion::Zero();
};

}  // namespace waymark
