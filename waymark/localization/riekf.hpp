#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "waymark/geometry/se2.hpp"
#include "waymark/localization/riekf_options.hpp"

/// The filter itself: propagation and update. When and with what is its caller's. Numbers in brackets are the
/// equations of docs/concepts/localization.md.
namespace waymark {

using SlowVector = Eigen::Matrix<double, 5, 1>;
using StateVector = Eigen::Matrix<double, 8, 1>;
using StateMatrix = Eigen::Matrix<double, 8, 8>;
using StateByMotion = Eigen::Matrix<double, 8, 4>;

/// Numbers that a filter is given and takes for right: the mounting of the sensor (left tangent in base: x,
/// y, z, roll, pitch, yaw), the logarithm of its scale (focal length, or of distances), its latency [s], and
/// the scales of the distance and of the turn by odometry.
inline constexpr int kSystematic = 10;
using SystematicVector = Eigen::Matrix<double, kSystematic, 1>;
using SystematicMatrix = Eigen::Matrix<double, kSystematic, kSystematic>;
using StateBySystematic = Eigen::Matrix<double, 8, kSystematic>;

/// In which coordinates the error lives: (1) X = Exp(xi) Xhat, or (12) x, y and yaw as numbers.
enum class ErrorState : std::uint8_t { RightInvariant, Coordinates };

/// A stretch of motion in base axes, as measured: constant twist over dt.
struct MotionStep {
  Eigen::Vector3d twist = Eigen::Vector3d::Zero();  ///< log of the motion: x, y [m], yaw [rad]
  double dt_s = 0;
  double yaw_dispute_rad = 0;  ///< how far gyro and wheels are apart in it
  bool standing = false;       ///< nothing moved; twist.z() is then what the gyro said nonetheless
  bool jumped = false;         ///< nobody knows where to: the twist says nothing
  double extra_m2 = 0;         ///< further variance of x and y, of the heading: motion that is guessed
  double extra_rad2 = 0;
  double share = 1;        ///< of what one message says, when a look divides it
  bool continues = false;  ///< an earlier part of the message went before
};

/// What one observation says, whitened and linearised at the estimate: residual (predicted minus measured)
/// and its derivatives. Rows beyond `rows` are not used.
struct Linearised {
  int landmark = 0;
  int rows = 0;
  Eigen::Matrix<double, 8, 1> residual = Eigen::Matrix<double, 8, 1>::Zero();
  Eigen::Matrix<double, 8, 3> H_pose = Eigen::Matrix<double, 8, 3>::Zero();  ///< for xi of (1)
  Eigen::Matrix<double, 8, 6> H_mount =
      Eigen::Matrix<double, 8, 6>::Zero();  ///< for the mounting of the sensor, left tangent in base
  Eigen::Matrix<double, 8, 6> H_tag =
      Eigen::Matrix<double, 8, 6>::Zero();  ///< for (place in map axes, turn about its own centre)
  Eigen::Matrix<double, 8, 1> H_scale =
      Eigen::Matrix<double, 8, 1>::Zero();  ///< for the logarithm of the sensor's scale
};

/// The estimate and what is doubted of it.
struct RiekfState {
  SE2 map_T_base{};
  SlowVector slow =
      SlowVector::Zero();  ///< distance scale - 1, yaw scale - 1, yaw bias [rad/s], slip [s], crab [rad]
  StateMatrix P = StateMatrix::Zero();  ///< of (xi, slow)
  /// 8 x 6(1 + landmarks): covariance with the errors that stay, of the mounting and of each landmark.
  Eigen::Matrix<double, 8, Eigen::Dynamic> C{};
  /// Covariance with the error of the message of motion under way (its twist), and with the speed of sliding.
  StateByMotion motion = StateByMotion::Zero();
  /// d(error) / d(errors of the numbers of kSystematic): how far each of them moves the estimate.
  StateBySystematic by_systematic = StateBySystematic::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< in base, of the last step [m/s, rad/s]
  /// Of which landmarks anything was seen: the others' part of C is zero.
  std::vector<std::uint8_t> met{};
};

/// Right-invariant EKF on SE(2) with slow states of the motion, and with the errors of the mounting and of
/// each landmark considered but not estimated (Schmidt, "Application of State-Space Methods to Navigation
/// Problems", 1966). After Barrau and Bonnabel, "The Invariant Extended Kalman Filter as a Stable Observer",
/// IEEE TAC 62(4), 2017. No allocation after construction.
class Riekf {
 public:
  static constexpr int kMost = 8;  ///< observations in one update
  using Batch = std::array<Linearised, kMost>;

  Riekf(const RiekfOptions& options, ErrorState error,
        const std::vector<Eigen::Matrix<double, 6, 6>>& landmarks);

  /// Starts at a pose with the covariance of xi (left tangent in map). What was learnt of the motion is kept
  /// when `keep_slow`.
  void start(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool keep_slow);
  /// The start was found by these: errors of the numbers of kSystematic moved it already, so that they show
  /// least in what was seen.
  void start_moved_by_systematic(const Batch& batch, int count);
  /// (4) to (6), (19), (20). O(landmarks).
  void propagate(const MotionStep& step);
  /// Squared Mahalanobis distance of an observation from what is expected of it: chi-square with `rows`
  /// degrees of freedom when all is well, (9). `place` is where it will stand in the batch if it is used.
  [[nodiscard]] double nis(const Linearised& z, int place = 0);
  /// (8) to (11) for the first `count` of a batch, all linearised at the state `offset` away from the
  /// present one (iterated update; zero: the present one). Gives the correction; does not apply it.
  /// `expected`: nis() has been asked of each at its place since the state changed, and need not be asked
  /// again.
  [[nodiscard]] StateVector gain(const Batch& batch, int count, const Eigen::Vector3d& offset,
                                 bool expected = false);
  /// Applies the correction of the last gain() and its covariance, (10), (11).
  void correct(const Batch& batch, int count, const StateVector& correction);
  /// The state a correction leads to.
  [[nodiscard]] SE2 corrected(const StateVector& correction) const;

  [[nodiscard]] const RiekfState& state() const { return state_; }
  void set_state(const RiekfState& state) { state_ = state; }
  /// The robot stands and something says that it turns: that is the bias of the yaw rate, (7).
  void observe_standing(double yaw_rate_rad_s, double sigma_rad_s);
  /// Of xi, in the left tangent, whatever the coordinates of the error.
  [[nodiscard]] Eigen::Matrix3d covariance() const;
  /// Logarithm of the determinant of S of the last nis().
  [[nodiscard]] double log_det() const { return log_det_; }
  /// S of the last nis() of a place.
  [[nodiscard]] const Eigen::Matrix<double, 8, 8>& innovation_covariance(int place) const {
    return S_[index_of(place, place)];
  }
  /// What errors of the numbers of kSystematic do to the residual of an observation, with what they did to
  /// the estimate until now.
  [[nodiscard]] StateBySystematic sensitivity(const Linearised& z) const;
  /// Covariance of xi, in the left tangent, that errors of those numbers of this covariance add.
  [[nodiscard]] Eigen::Matrix3d covariance_of(const SystematicMatrix& errors) const;
  /// P if the errors that stay were known: what looks teach and time takes away.
  [[nodiscard]] StateMatrix covariance_but_for_lasting() const;
  /// d(error after) / d(error before) of the last propagate().
  [[nodiscard]] const StateMatrix& last_transition() const { return transition_; }
  /// What covariance after and before it have in common beyond that: errors of motion that went on.
  [[nodiscard]] StateMatrix last_motion_in_common() const {
    return moved_by_.lazyProduct(motion_before_.transpose());
  }

 private:
  using Block = Eigen::Matrix<double, 8, 8>;
  /// An observation's side of the innovation's covariance: block (a, b) is left(a) times right(b), (9).
  struct Reach {
    Block cross;                         ///< covariance of state and residual: P H' + C N'
    Eigen::Matrix<double, 8, 12> left;   ///< H, M, T C_t'
    Eigen::Matrix<double, 12, 8> right;  ///< of cross the pose; M's errors; H'
  };
  [[nodiscard]] Eigen::Matrix3d to_error() const;  ///< d xi / d error
  [[nodiscard]] Reach reach(const Linearised& z) const;
  [[nodiscard]] Block innovation(const Linearised& a, const Reach& of_a, const Linearised& b,
                                 const Reach& of_b) const;
  [[nodiscard]] Eigen::Matrix<double, 8, 3> H_of(const Linearised& z) const;
  [[nodiscard]] Eigen::Matrix<double, 8, 1> H_latency(const Linearised& z) const;
  [[nodiscard]] auto block(int landmark) const {
    return state_.C.middleCols<6>(6 * (Eigen::Index{landmark} + 1));
  }
  [[nodiscard]] auto block(int landmark) { return state_.C.middleCols<6>(6 * (Eigen::Index{landmark} + 1)); }
  void expect(const Linearised& z, int place);
  [[nodiscard]] bool factorize(int count);
  [[nodiscard]] static std::size_t index_of(int i, int j) {
    return static_cast<std::size_t>(kMost) * static_cast<std::size_t>(i) + static_cast<std::size_t>(j);
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
  std::array<Reach, kMost> reach_;
  std::array<Block, std::size_t{kMost} * kMost> S_;   ///< lower triangle by blocks; its factor L in place
  std::array<Block, kMost> W_;                        ///< L^-1 (P H' + C N')'
  std::array<Eigen::Matrix<double, 8, 1>, kMost> y_;  ///< L^-1 r
  double log_det_ = 0;
  bool sound_ = false;  ///< S could be factorized
  StateMatrix transition_ = StateMatrix::Identity();
  StateByMotion moved_by_ = StateByMotion::Zero();  ///< d(error after) / d(errors of motion)
  StateByMotion motion_before_ = StateByMotion::Zero();
};

}  // namespace waymark
