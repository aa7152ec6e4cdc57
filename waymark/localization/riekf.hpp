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

/// In which coordinates the error lives: (1) X = Exp(xi) Xhat, or (12) x, y and yaw as numbers.
enum class ErrorState : std::uint8_t { RightInvariant, Coordinates };

/// A stretch of motion in base axes, as measured: constant twist over dt.
struct MotionStep {
  Eigen::Vector3d twist = Eigen::Vector3d::Zero();  ///< log of the motion: x, y [m], yaw [rad]
  double dt_s = 0;
  double yaw_dispute_rad = 0;  ///< how far gyro and wheels are apart in it
  bool standing = false;       ///< nothing moved; twist.z() is then what the gyro said nonetheless
  double extra_m2 = 0;         ///< further variance of x and y, of the heading: motion that is guessed
  double extra_rad2 = 0;
};

/// What one sighting says, whitened and linearised at the estimate: residual (predicted minus measured) and
/// its derivatives. Rows beyond `rows` are not used.
struct Linearised {
  int landmark = 0;
  int rows = 0;
  Eigen::Matrix<double, 8, 1> residual = Eigen::Matrix<double, 8, 1>::Zero();
  Eigen::Matrix<double, 8, 3> H_pose = Eigen::Matrix<double, 8, 3>::Zero();  ///< for xi of (1)
  Eigen::Matrix<double, 8, 6> H_mount =
      Eigen::Matrix<double, 8, 6>::Zero();  ///< for the mounting of the sensor, left tangent in base
  Eigen::Matrix<double, 8, 6> H_tag =
      Eigen::Matrix<double, 8, 6>::Zero();  ///< for (place in map axes, turn about its own centre)
};

/// The estimate and what is doubted of it.
struct RiekfState {
  SE2 map_T_base{};
  SlowVector slow =
      SlowVector::Zero();  ///< distance scale - 1, yaw scale - 1, yaw bias [rad/s], slip [s], crab [rad]
  StateMatrix P = StateMatrix::Zero();  ///< of (xi, slow)
  /// 8 x 6(1 + landmarks): covariance with the errors that stay, of the mounting and of each landmark.
  Eigen::Matrix<double, 8, Eigen::Dynamic> C{};
};

/// Right-invariant EKF on SE(2) with slow states of the motion, and with the errors of the mounting and of
/// each landmark considered but not estimated (Schmidt, "Application of State-Space Methods to Navigation
/// Problems", 1966). After Barrau and Bonnabel, "The Invariant Extended Kalman Filter as a Stable Observer",
/// IEEE TAC 62(4), 2017. No allocation after construction.
class Riekf {
 public:
  static constexpr int kMost = 8;  ///< sightings in one update
  using Batch = std::array<Linearised, kMost>;

  Riekf(const RiekfOptions& options, ErrorState error,
        const std::vector<Eigen::Matrix<double, 6, 6>>& landmarks);

  /// Starts at a pose with the covariance of xi (left tangent in map). What was learnt of the motion is kept
  /// when `keep_slow`.
  void start(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool keep_slow);
  /// (4) to (7). O(landmarks).
  void propagate(const MotionStep& step);
  /// Squared Mahalanobis distance of a sighting from what is expected of it: chi-square with `rows` degrees
  /// of freedom when all is well, (9).
  [[nodiscard]] double nis(const Linearised& z) const;
  /// (8) to (11) for the first `count` of a batch, all linearised at the state `prior_offset` away from the
  /// present one (iterated update; zero: the present one). Gives the correction; does not apply it.
  [[nodiscard]] StateVector gain(const Batch& batch, int count, const Eigen::Vector3d& offset);
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
  /// d(error after) / d(error before) of the last propagate().
  [[nodiscard]] const StateMatrix& last_transition() const { return transition_; }

 private:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 8 * kMost, 8 * kMost>;
  using Gain = Eigen::Matrix<double, 8, Eigen::Dynamic, Eigen::ColMajor, 8, 8 * kMost>;
  [[nodiscard]] Eigen::Matrix3d to_error() const;  ///< d xi / d error
  [[nodiscard]] Eigen::Matrix<double, 8, 8> cross(const Linearised& z) const;
  [[nodiscard]] Eigen::Matrix<double, 8, 8> innovation(const Linearised& a, const Linearised& b,
                                                       const Eigen::Matrix<double, 8, 8>& cross_b) const;
  [[nodiscard]] Eigen::Matrix<double, 8, 3> H_of(const Linearised& z) const;
  [[nodiscard]] auto block(int landmark) const {
    return state_.C.middleCols<6>(6 * (Eigen::Index{landmark} + 1));
  }
  void update_covariance(const Batch& batch, int count);

  MotionNoise noise_;
  double landmark_time_s_;
  ErrorState error_;
  Eigen::Matrix<double, 6, 6> mount_;
  std::vector<Eigen::Matrix<double, 6, 6>> landmarks_;
  RiekfState state_;
  Rows S_;
  Gain A_;
  Gain K_;
  Eigen::Matrix<double, 8 * kMost, 1> r_;
  StateMatrix transition_ = StateMatrix::Identity();
};

}  // namespace waymark
