#include "waymark/localization/riekf.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using StateByBias = Eigen::Matrix<double, 8, 6>;

SlowVector slow_variances(const MotionNoise& noise) {
  SlowVector sigma;
  sigma << noise.distance_scale_sigma, noise.yaw_scale_sigma, noise.yaw_bias_sigma_rad_s, noise.slip_sigma_s,
      noise.crab_sigma_rad;
  return sigma.cwiseAbs2();
}

/// The true twist as the slow states have it, (3), and its derivative for them.
Eigen::Vector3d mended(const MotionStep& step, const SlowVector& slow, Eigen::Matrix<double, 3, 5>* J) {
  const double turn_rate = step.dt_s > 0 ? step.twist.z() / step.dt_s : 0;
  const double sideways = step.twist.x() * turn_rate;  // speed times yaw rate times dt
  if (step.standing) {
    J->setZero();
    return Eigen::Vector3d::Zero();
  }
  *J << step.twist.x(), 0, 0, 0, -step.twist.y(),  //
      0, 0, 0, sideways, step.twist.x(),           //
      0, step.twist.z(), step.dt_s, 0, 0;
  return step.twist + *J * slow;
}

/// Variances of the twist's noise over a step, (5).
Eigen::Vector3d variances(const MotionStep& step, const MotionNoise& noise) {
  const auto sq = [](double x) { return x * x; };
  const double driven = step.twist.head<2>().norm();
  const double drift = sq(noise.drift_m_sqrt_s) * step.dt_s + step.extra_m2;
  if (step.standing) return {drift, drift, step.extra_rad2};
  const double dispute = sq(noise.slip_share * step.yaw_dispute_rad);
  const double yaw = sq(noise.yaw_rad_sqrt_m) * driven +
                     sq(noise.yaw_rad_sqrt_rad) * std::abs(step.twist.z()) +
                     sq(noise.yaw_rad_sqrt_s) * step.dt_s + step.extra_rad2 + dispute;
  // A turn in dispute of a robot about 0.2 m long is as much of a dispute about where it went.
  constexpr double kLever = 0.1;
  const double slip = sq(kLever) * dispute;
  return {sq(noise.along_m_sqrt_m) * driven + drift + slip, sq(noise.across_m_sqrt_m) * driven + drift + slip,
          yaw};
}

}  // namespace

Riekf::Riekf(const RiekfOptions& options, ErrorState error, const std::vector<Matrix6>& landmarks)
    : noise_(options.motion), landmark_time_s_(options.tag_time_s), error_(error), landmarks_(landmarks) {
  const auto sq = [](double x) { return x * x; };
  const double m = sq(options.mounting_sigma_m);
  const double rad = sq(options.mounting_sigma_rad);
  mount_ = (Eigen::Matrix<double, 6, 1>() << m, m, m, rad, rad, rad).finished().asDiagonal();
  state_.P.diagonal() << 1e6, 1e6, 10, slow_variances(noise_);
  state_.C = Eigen::Matrix<double, 8, Eigen::Dynamic>::Zero(
      8, static_cast<Eigen::Index>(6 * (landmarks_.size() + 1)));
}

Eigen::Matrix3d Riekf::to_error() const {
  if (error_ == ErrorState::RightInvariant) return Eigen::Matrix3d::Identity();
  return internal::coordinate_jacobian(state_.map_T_base, -1);
}

Eigen::Matrix3d Riekf::covariance() const {
  const Eigen::Matrix3d J = to_error();
  return internal::propagate<3>(J, state_.P.topLeftCorner<3, 3>());
}

void Riekf::start(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool keep_slow) {
  state_.map_T_base = map_T_base;
  const Eigen::Matrix3d J = to_error().inverse();
  state_.P.topRightCorner<3, 5>().setZero();
  state_.P.bottomLeftCorner<5, 3>().setZero();
  state_.P.topLeftCorner<3, 3>() = internal::propagate<3>(J, covariance);
  state_.C.topRows<3>().setZero();
  if (keep_slow) return;
  state_.slow.setZero();
  state_.P.bottomRightCorner<5, 5>() = slow_variances(noise_).asDiagonal();
  state_.C.setZero();
}

void Riekf::propagate(const MotionStep& step) {
  Eigen::Matrix<double, 3, 5> J_u_slow;
  const Eigen::Vector3d u = mended(step, state_.slow, &J_u_slow);
  const SE2 before = state_.map_T_base;
  const Eigen::Matrix3d G_xi = before.adjoint() * SE2::left_jacobian(u);
  const Eigen::Matrix3d from_error = to_error();
  state_.map_T_base = before * SE2::exp(u);
  Eigen::Matrix3d into_error = Eigen::Matrix3d::Identity();
  if (error_ == ErrorState::Coordinates) into_error = internal::coordinate_jacobian(state_.map_T_base, 1);
  const double kept = std::exp(-step.dt_s / noise_.slow_time_s);
  transition_.setZero();
  transition_.topLeftCorner<3, 3>() = into_error * from_error;
  transition_.topRightCorner<3, 5>() = into_error * G_xi * J_u_slow;
  transition_.bottomRightCorner<5, 5>().diagonal().setConstant(kept);
  const Eigen::Matrix3d G = into_error * G_xi;
  StateMatrix P = transition_ * state_.P * transition_.transpose();
  P.topLeftCorner<3, 3>() += G * variances(step, noise_).asDiagonal() * G.transpose();
  P.bottomRightCorner<5, 5>().diagonal() += (1 - kept * kept) * slow_variances(noise_);
  state_.P = internal::symmetrized<8>(P);
  state_.slow *= kept;
  const double fades = std::exp(-step.dt_s / landmark_time_s_);
  for (Eigen::Index i = 0; i < state_.C.cols(); ++i) {
    const StateVector c = transition_ * state_.C.col(i);
    state_.C.col(i) = i < 6 ? c : StateVector(fades * c);
  }
}

void Riekf::observe_standing(double yaw_rate_rad_s, double sigma_rad_s) {
  constexpr Eigen::Index kBias = 5;
  const double S = state_.P(kBias, kBias) + sigma_rad_s * sigma_rad_s;
  if (!(S > 0) || state_.P(kBias, kBias) <= 0) return;
  const StateVector K = state_.P.col(kBias) / S;
  const StateVector correction = K * (-yaw_rate_rad_s - state_.slow[2]);
  StateMatrix T = StateMatrix::Identity();
  T.col(kBias) -= K;
  state_.P =
      internal::symmetrized<8>(T * state_.P * T.transpose() + sigma_rad_s * sigma_rad_s * K * K.transpose());
  for (Eigen::Index i = 0; i < state_.C.cols(); ++i) state_.C.col(i) = StateVector(T * state_.C.col(i));
  state_.map_T_base = corrected(correction);
  state_.slow += correction.tail<5>();
}

Eigen::Matrix<double, 8, 3> Riekf::H_of(const Linearised& z) const { return z.H_pose * to_error(); }

Eigen::Matrix<double, 8, 8> Riekf::cross(const Linearised& z) const {
  Eigen::Matrix<double, 8, 8> A = state_.P.leftCols<3>() * H_of(z).transpose();
  A += state_.C.leftCols<6>() * z.H_mount.transpose();
  A += block(z.landmark) * z.H_tag.transpose();
  return A;
}

Eigen::Matrix<double, 8, 8> Riekf::innovation(const Linearised& a, const Linearised& b,
                                              const Eigen::Matrix<double, 8, 8>& cross_b) const {
  Eigen::Matrix<double, 8, 8> S = H_of(a) * cross_b.topRows<3>();
  const Matrix6 mount = mount_;
  const Eigen::Matrix<double, 3, 8> H_b = H_of(b).transpose();
  S += a.H_mount * (state_.C.topLeftCorner<3, 6>().transpose() * H_b + mount * b.H_mount.transpose());
  S += a.H_tag * (block(a.landmark).topRows<3>().transpose() * H_b);
  if (a.landmark == b.landmark)
    S += a.H_tag * landmarks_[static_cast<std::size_t>(a.landmark)] * b.H_tag.transpose();
  return S;
}

double Riekf::nis(const Linearised& z) const {
  Eigen::Matrix<double, 8, 8> S = innovation(z, z, cross(z));
  S.diagonal().array() += 1;
  const Eigen::LLT<Eigen::Matrix<double, 8, 8>> llt(S);
  if (llt.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  return z.residual.dot(llt.solve(z.residual));
}

StateVector Riekf::gain(const Batch& batch, int count, const Eigen::Vector3d& offset) {
  const Eigen::Index rows = 8 * Eigen::Index{count};
  S_.resize(rows, rows);
  A_.resize(8, rows);
  for (int j = 0; j < count; ++j) {
    const Linearised& b = batch[static_cast<std::size_t>(j)];
    const Eigen::Matrix<double, 8, 8> cross_b = cross(b);
    A_.middleCols<8>(8 * Eigen::Index{j}) = cross_b;
    for (int i = j; i < count; ++i)
      S_.block<8, 8>(8 * Eigen::Index{i}, 8 * Eigen::Index{j}) =
          innovation(batch[static_cast<std::size_t>(i)], b, cross_b);
    r_.segment<8>(8 * Eigen::Index{j}) = b.residual - b.H_pose * offset;
  }
  S_.diagonal().array() += 1;
  K_.resize(8, rows);
  const Eigen::LLT<Eigen::Ref<Rows>> llt(S_);
  if (llt.info() != Eigen::Success) {
    K_.setZero();
    return StateVector::Zero();
  }
  // K = A S^-1 = (S^-1 A^T)^T, by two triangular solves on the rows of A
  K_ = A_;
  llt.matrixL().transpose().solveInPlace<Eigen::OnTheRight>(K_);
  llt.matrixL().solveInPlace<Eigen::OnTheRight>(K_);
  return -(K_ * r_.head(rows));
}

SE2 Riekf::corrected(const StateVector& correction) const {
  const SE2& X = state_.map_T_base;
  const Eigen::Vector3d e = correction.head<3>();
  if (error_ == ErrorState::RightInvariant) return SE2::exp(e) * X;
  return {X.x() + e.x(), X.y() + e.y(), X.yaw() + e.z()};
}

void Riekf::correct(const Batch& batch, int count, const StateVector& correction) {
  update_covariance(batch, count);
  state_.map_T_base = corrected(correction);
  state_.slow += correction.tail<5>();
}

/// Joseph's form with considered errors, (11): L = [I - K H, -K H_mount, -K H_tag] of the joint covariance.
void Riekf::update_covariance(const Batch& batch, int count) {
  StateMatrix T = StateMatrix::Identity();
  StateByBias mounted = StateByBias::Zero();
  std::array<StateByBias, kMost> tagged;
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const auto K = K_.middleCols<8>(8 * Eigen::Index{i});
    T.leftCols<3>() -= K * H_of(batch[at]);
    mounted += K * batch[at].H_mount;
    tagged[at] = K * batch[at].H_tag;
  }
  const auto C_mount = state_.C.leftCols<6>();
  StateMatrix half = -T * C_mount * mounted.transpose();
  half += mounted * mount_ * mounted.transpose() / 2;
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    half -= T * block(batch[at].landmark) * tagged[at].transpose();
    for (int j = 0; j < count; ++j) {
      const auto other = static_cast<std::size_t>(j);
      if (batch[other].landmark == batch[at].landmark)
        half += tagged[at] * landmarks_[static_cast<std::size_t>(batch[at].landmark)] *
                tagged[other].transpose() / 2;
    }
  }
  StateMatrix P = T * state_.P * T.transpose() + half + half.transpose();
  P.noalias() += K_.lazyProduct(K_.transpose());
  state_.P = internal::symmetrized<8>(P);
  for (Eigen::Index i = 0; i < state_.C.cols(); ++i) state_.C.col(i) = StateVector(T * state_.C.col(i));
  state_.C.leftCols<6>() -= mounted * mount_;
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const int landmark = batch[at].landmark;
    state_.C.middleCols<6>(6 * (Eigen::Index{landmark} + 1)) -=
        tagged[at] * landmarks_[static_cast<std::size_t>(landmark)];
  }
}

}  // namespace waymark
