#include "waymark/localization/riekf.hpp"

#include <algorithm>
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

constexpr Eigen::Index kCrab = 4;  ///< index among the slow states

SlowVector slow_variances(const MotionNoise& noise) {
  SlowVector sigma;
  sigma << noise.distance_scale_sigma, noise.yaw_scale_sigma, noise.yaw_bias_sigma_rad_s, noise.slip_sigma_s,
      noise.crab_sigma_rad;
  return sigma.cwiseAbs2();
}

/// The twist as corrected by the slow states, (3), and its derivative with respect to them.
Eigen::Vector3d corrected_twist(const MotionStep& step, const SlowVector& slow,
                                Eigen::Matrix<double, 3, 5>* J) {
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

/// Noise variances of the twist over one step, (5).
Eigen::Vector3d variances(const MotionStep& step, const MotionNoise& noise) {
  const auto sq = [](double x) { return x * x; };
  const double driven = step.twist.head<2>().norm();
  const double drift = sq(noise.drift_m_sqrt_s) * step.dt_s + step.extra_m2;
  if (step.standing) return {drift, drift, step.extra_rad2};
  const double disagreement = sq(noise.slip_share * step.yaw_disagreement_rad);
  const double yaw = sq(noise.yaw_rad_sqrt_m) * driven +
                     sq(noise.yaw_rad_sqrt_rad) * std::abs(step.twist.z()) +
                     sq(noise.yaw_rad_sqrt_s) * step.dt_s + step.extra_rad2 + disagreement;
  // For a robot about 0.2 m long, a disagreement about the turn implies one about the translation.
  constexpr double kLever = 0.1;
  const double slip = sq(kLever) * disagreement;
  return {sq(noise.along_m_sqrt_m) * driven + drift + slip, sq(noise.across_m_sqrt_m) * driven + drift + slip,
          yaw};
}

}  // namespace

Riekf::Riekf(const RiekfOptions& options, ErrorState error, const std::vector<Matrix6>& landmarks)
    : noise_(options.motion), landmark_time_s_(options.tag_time_s), error_(error), landmarks_(landmarks) {
  const auto sq = [](double x) { return x * x; };
  const double m = sq(options.mounting_sigma_m);
  const double rad = sq(options.mounting_sigma_rad);
  mount_ = (Eigen::Matrix<double, 6, 1>() << m, m, m, rad, rad, rad).finished();
  state_.P.diagonal() << 1e6, 1e6, 10, slow_variances(noise_);
  state_.C = Eigen::Matrix<double, 8, Eigen::Dynamic>::Zero(
      8, static_cast<Eigen::Index>(6 * (landmarks_.size() + 1)));
  state_.met.assign(landmarks_.size(), 0);
}

Eigen::Matrix3d Riekf::to_error() const {
  if (error_ == ErrorState::RightInvariant) return Eigen::Matrix3d::Identity();
  return internal::coordinate_jacobian(state_.map_T_base, -1);
}

Eigen::Matrix3d Riekf::covariance() const {
  const Eigen::Matrix3d J = to_error();
  return internal::propagate<3>(J, state_.P.topLeftCorner<3, 3>());
}

Eigen::Matrix3d Riekf::covariance_of(const SystematicMatrix& errors) const {
  const Eigen::Matrix<double, 3, kSystematic> moved =
      to_error().lazyProduct(state_.by_systematic.topRows<3>());
  return moved * errors * moved.transpose();
}

void Riekf::start(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool keep_slow) {
  state_.map_T_base = map_T_base;
  const Eigen::Matrix3d J = to_error().inverse();
  state_.P.topRightCorner<3, 5>().setZero();
  state_.P.bottomLeftCorner<5, 3>().setZero();
  state_.P.topLeftCorner<3, 3>() = internal::propagate<3>(J, covariance);
  state_.C.topRows<3>().setZero();
  state_.motion.topRows<3>().setZero();
  state_.by_systematic.topRows<3>().setZero();
  if (keep_slow) return;
  state_.slow.setZero();
  state_.P.bottomRightCorner<5, 5>() = slow_variances(noise_).asDiagonal();
  state_.C.setZero();
  state_.motion.setZero();
  state_.by_systematic.setZero();
  std::ranges::fill(state_.met, std::uint8_t{0});
}

void Riekf::propagate(const MotionStep& step) {
  Eigen::Matrix<double, 3, 5> J_u_slow;
  const Eigen::Vector3d u = corrected_twist(step, state_.slow, &J_u_slow);
  const SE2 before = state_.map_T_base;
  const Eigen::Matrix3d G_xi = before.adjoint() * SE2::left_jacobian(u);
  const Eigen::Matrix3d from_error = to_error();
  state_.map_T_base = before * SE2::exp(u);
  Eigen::Matrix3d into_error = Eigen::Matrix3d::Identity();
  if (error_ == ErrorState::Coordinates) into_error = internal::coordinate_jacobian(state_.map_T_base, 1);
  const double kept = std::exp(-step.dt_s / noise_.slow_time_s);
  SlowVector fades = SlowVector::Constant(kept);
  if (noise_.crab_share > 0) fades[kCrab] = 1;
  transition_.setZero();
  transition_.topLeftCorner<3, 3>() = into_error * from_error;
  transition_.topRightCorner<3, 5>() = into_error * G_xi * J_u_slow;
  transition_.bottomRightCorner<5, 5>().diagonal() = fades;
  const Eigen::Matrix3d G = into_error * G_xi;
  const StateMatrix carried = transition_.lazyProduct(state_.P);
  StateMatrix P = carried.lazyProduct(transition_.transpose());
  add_motion_noise(step, G, P);
  P.bottomRightCorner<5, 5>().diagonal() +=
      (SlowVector::Ones() - fades.cwiseAbs2()).cwiseProduct(slow_variances(noise_));
  state_.P = internal::symmetrized<8>(P);
  state_.slow = state_.slow.cwiseProduct(fades);
  carry_correlations(fades, std::exp(-step.dt_s / landmark_time_s_));
  state_.by_systematic.topRightCorner<3, 2>() += G * J_u_slow.leftCols<2>();
  if (step.dt_s > 0) state_.velocity = u / step.dt_s;
}

/// Two errors of the motion last longer than one step, (19), (20): the error of a message and the sliding
/// velocity. The error of a message is a single twist, common to all parts into which observations divide the
/// message. Neither is estimated, but their covariances with the state are tracked.
void Riekf::add_motion_noise(const MotionStep& step, const Eigen::Matrix3d& G, StateMatrix& P) {
  const double share = noise_.independent_parts ? 1 : step.share;
  const bool continues = step.continues && !noise_.independent_parts;
  if (!continues) state_.motion.leftCols<3>().setZero();
  motion_before_ = state_.motion;
  moved_by_.setZero();
  moved_by_.topLeftCorner<3, 3>() = share * G;
  // This heading noise does not rotate the translation from odometry, so the translation is skewed by the
  // same angle in the opposite direction.
  moved_by_(3 + kCrab, 2) = -share * noise_.crab_share;
  const Eigen::Vector3d Q = variances(step, noise_) / share;  // for the whole message
  const double time_s = noise_.slide_time_s;
  const double lasts = std::exp(-step.dt_s / time_s);
  const double slide2 = noise_.slide_m_s * noise_.slide_m_s;
  const bool slides = slide2 > 0 && !step.standing;
  if (slides) moved_by_.topRightCorner<3, 1>() = time_s * (1 - lasts) * G.col(1);
  state_.motion = transition_.lazyProduct(motion_before_);
  if (continues || slides) {
    const StateMatrix common = state_.motion.lazyProduct(moved_by_.transpose());
    P += common + common.transpose();
  }
  const Eigen::Matrix<double, 8, 3> by_message = moved_by_.leftCols<3>() * Q.asDiagonal();
  P += by_message.lazyProduct(moved_by_.leftCols<3>().transpose());
  if (share < 1) state_.motion.leftCols<3>() += by_message;
  state_.motion.col(3) *= lasts;
  if (!slides) return;
  // Displacement due to a velocity with correlation time time_s: an integrated Gauss-Markov process.
  const double way2 = 2 * slide2 * time_s * (step.dt_s - time_s * (1 - lasts));
  P.topLeftCorner<3, 3>() += way2 * G.col(1) * G.col(1).transpose();
  state_.motion.col(3) += slide2 * moved_by_.col(3);
}

/// Propagates C, (6). The slow states merely fade, so a matrix product is needed only for the pose.
void Riekf::carry_correlations(const SlowVector& slow_fade, double landmarks_fade) {
  const Eigen::Matrix<double, 3, 8> to_pose = transition_.topRows<3>();
  const auto carry = [&](auto C, double fades) {
    const Eigen::Matrix<double, 3, decltype(C)::ColsAtCompileTime> pose = to_pose.lazyProduct(C);
    C.template topRows<3>() = fades * pose;
    C.template bottomRows<5>().array().colwise() *= fades * slow_fade.array();
  };
  carry(state_.C.leftCols<6>(), 1);
  carry(state_.by_systematic.leftCols<kSystematic>(), 1);
  for (std::size_t i = 0; i < state_.met.size(); ++i)
    if (state_.met[i] != 0) carry(block(static_cast<int>(i)), landmarks_fade);
}

void Riekf::observe_zero_velocity(double yaw_rate_rad_s, double sigma_rad_s) {
  constexpr Eigen::Index kBias = 5;
  const double S = state_.P(kBias, kBias) + sigma_rad_s * sigma_rad_s;
  if (!(S > 0) || state_.P(kBias, kBias) <= 0) return;
  const StateVector K = state_.P.col(kBias) / S;
  const StateVector correction = K * (-yaw_rate_rad_s - state_.slow[2]);
  StateMatrix T = StateMatrix::Identity();
  T.col(kBias) -= K;
  state_.P =
      internal::symmetrized<8>(T * state_.P * T.transpose() + sigma_rad_s * sigma_rad_s * K * K.transpose());
  for (Eigen::Index i = 0; i < state_.C.cols(); ++i) state_.C.col(i) -= state_.C(kBias, i) * K;  // T C
  state_.motion = T.lazyProduct(StateByMotion(state_.motion));
  state_.by_systematic = T.lazyProduct(StateBySystematic(state_.by_systematic));
  state_.map_T_base = corrected(correction);
  state_.slow += correction.tail<5>();
}

SE2 Riekf::corrected(const StateVector& correction) const {
  const SE2& X = state_.map_T_base;
  const Eigen::Vector3d e = correction.head<3>();
  if (error_ == ErrorState::RightInvariant) return SE2::exp(e) * X;
  return {X.x() + e.x(), X.y() + e.y(), X.yaw() + e.z()};
}

StateMatrix Riekf::conditional_covariance() const {
  StateMatrix P = state_.P;
  const auto without = [&P](const StateByBias& C, const Matrix6& Pi) {
    // A state without variance has no correlations; the added diagonal keeps the inverse finite.
    const Matrix6 regular = Pi + 1e-12 * Matrix6::Identity();
    P -= C * regular.ldlt().solve(C.transpose());
  };
  without(state_.C.leftCols<6>(), mount_.asDiagonal());
  for (std::size_t i = 0; i < state_.met.size(); ++i)
    if (state_.met[i] != 0)
      without(state_.C.middleCols<6>(6 * (static_cast<Eigen::Index>(i) + 1)), landmarks_[i]);
  return internal::symmetrized<8>(P);
}

// Effect of an observation on the estimate, (8) to (11).
namespace {

/// Replaces S = L L' with the inverse of L. Returns false if S is not positive definite.
bool invert_root(Eigen::Matrix<double, 8, 8>& S) {
  Eigen::Matrix<double, 8, 8> inverse = Eigen::Matrix<double, 8, 8>::Zero();
  for (Eigen::Index j = 0; j < 8; ++j) {
    double pivot = S(j, j);
    for (Eigen::Index k = 0; k < j; ++k) pivot -= S(j, k) * S(j, k);
    if (!(pivot > 0)) return false;
    const double root = 1 / std::sqrt(pivot);
    S(j, j) = root;
    for (Eigen::Index i = j + 1; i < 8; ++i) {
      double below = S(i, j);
      for (Eigen::Index k = 0; k < j; ++k) below -= S(i, k) * S(j, k);
      S(i, j) = below * root;
    }
    inverse(j, j) = root;
    for (Eigen::Index k = 0; k < j; ++k) {
      double sum = 0;
      for (Eigen::Index m = k; m < j; ++m) sum += S(j, m) * inverse(m, k);
      inverse(j, k) = -root * sum;
    }
  }
  S = inverse;
  return true;
}

using Block = Eigen::Matrix<double, 8, 8>;

/// r' S^-1 r; infinite if S is not positive definite.
double mahalanobis2(const Block& S, const Eigen::Matrix<double, 8, 1>& r, double& determinant) {
  Block L = S;
  Eigen::Matrix<double, 8, 1> y = r;
  double sum = 0;
  for (Eigen::Index j = 0; j < 8; ++j) {
    if (!(L(j, j) > 0)) return std::numeric_limits<double>::infinity();
    const double inverse = 1 / L(j, j);
    determinant *= L(j, j);
    sum += y[j] * y[j] * inverse;
    for (Eigen::Index i = j + 1; i < 8; ++i) {
      const double share = L(i, j) * inverse;
      y[i] -= share * y[j];
      for (Eigen::Index k = j + 1; k <= i; ++k) L(i, k) -= share * L(k, j);
    }
  }
  return sum;
}

// The upper right 4 x 4 block of a triangular factor is zero and is skipped.

/// Subtracts A A' from the lower triangle of S.
void subtract_square(const Block& A, Block& S) {
  S.topLeftCorner<4, 4>() -= A.topRows<4>().lazyProduct(A.topRows<4>().transpose());
  S.bottomRows<4>() -= A.bottomRows<4>().lazyProduct(A.transpose());
}

/// L A, where L is lower triangular.
Block lower_times(const Block& L, const Block& A) {
  Block LA;
  LA.topRows<4>() = L.topLeftCorner<4, 4>().lazyProduct(A.topRows<4>());
  LA.bottomRows<4>() = L.bottomRows<4>().lazyProduct(A);
  return LA;
}

/// L' A, where L is lower triangular.
Block upper_times(const Block& L, const Block& A) {
  Block LA;
  LA.topRows<4>() = L.leftCols<4>().transpose().lazyProduct(A);
  LA.bottomRows<4>() = L.bottomRightCorner<4, 4>().transpose().lazyProduct(A.bottomRows<4>());
  return LA;
}

/// A L', where L is lower triangular.
Block times_upper(const Block& A, const Block& L) {
  Block AL;
  AL.leftCols<4>() = A.leftCols<4>().lazyProduct(L.topLeftCorner<4, 4>().transpose());
  AL.rightCols<4>() = A.lazyProduct(L.bottomRows<4>().transpose());
  return AL;
}

}  // namespace

Eigen::Matrix<double, 8, 3> Riekf::H_of(const Linearised& z) const {
  if (error_ == ErrorState::RightInvariant) return z.H_pose;
  return z.H_pose * to_error();
}

/// Derivative of the residual with respect to the latency, because an observation made earlier is from an
/// earlier pose.
Eigen::Matrix<double, 8, 1> Riekf::H_camera_latency(const Linearised& z) const {
  return -z.H_pose.lazyProduct(state_.map_T_base.adjoint() * state_.velocity);
}

StateBySystematic Riekf::sensitivity(const Linearised& z) const {
  StateBySystematic J = H_of(z).lazyProduct(state_.by_systematic.topRows<3>());
  J.leftCols<6>() += z.H_mount;
  J.col(6) += z.H_scale;
  J.col(7) += H_camera_latency(z);
  return -J;
}

void Riekf::start_moved_by_systematic(const Batch& batch, int count) {
  state_.by_systematic.topRows<3>().setZero();
  Eigen::Matrix3d information = state_.P.topLeftCorner<3, 3>().inverse() * 1e-3;
  Eigen::Matrix<double, 3, kSystematic> shown = Eigen::Matrix<double, 3, kSystematic>::Zero();
  for (int i = 0; i < count; ++i) {
    const Linearised& z = batch[static_cast<std::size_t>(i)];
    const Eigen::Matrix<double, 8, 3> H = H_of(z);
    information += H.transpose().lazyProduct(H);
    shown += H.transpose().lazyProduct(sensitivity(z));
  }
  state_.by_systematic.topRows<3>() = information.ldlt().solve(shown);
}

// For 8 x 8 matrices and larger, Eigen uses its kernel for large matrices, which is slower for products of
// this size; lazyProduct() multiplies directly.
Riekf::Reach Riekf::reach(const Linearised& z) const {
  const Eigen::Matrix<double, 8, 3> H = H_of(z);
  const Eigen::Matrix<double, 3, 8> Ht = H.transpose();
  const Eigen::Matrix<double, 6, 8> Mt = z.H_mount.transpose();
  Reach all;
  all.cross = state_.P.leftCols<3>().lazyProduct(Ht);
  all.cross += state_.C.leftCols<6>().lazyProduct(Mt);
  all.left.leftCols<3>() = H;
  all.left.middleCols<6>(3) = z.H_mount;
  if (state_.met[static_cast<std::size_t>(z.landmark)] != 0) {
    const StateByBias C = block(z.landmark);
    all.cross += C.lazyProduct(z.H_tag.transpose());
    all.left.rightCols<3>() = z.H_tag.lazyProduct(C.topRows<3>().transpose());
  } else {
    all.left.rightCols<3>().setZero();
  }
  all.right.topRows<3>() = all.cross.topRows<3>();
  all.right.middleRows<6>(3) = mount_.asDiagonal() * Mt;
  all.right.middleRows<6>(3) += state_.C.topLeftCorner<3, 6>().transpose().lazyProduct(Ht);
  all.right.bottomRows<3>() = Ht;
  return all;
}

Riekf::Block Riekf::innovation(const Linearised& a, const Reach& of_a, const Linearised& b,
                               const Reach& of_b) const {
  Block S = of_a.left.lazyProduct(of_b.right);
  if (a.landmark == b.landmark) {
    const Eigen::Matrix<double, 8, 6> T =
        a.H_tag.lazyProduct(landmarks_[static_cast<std::size_t>(a.landmark)]);
    S += T.lazyProduct(b.H_tag.transpose());
  }
  return S;
}

void Riekf::expect(const Linearised& z, int place) {
  Reach& of_z = reach_[static_cast<std::size_t>(place)];
  of_z = reach(z);
  S(place, place) = innovation(z, of_z, z, of_z);
  S(place, place).diagonal().array() += 1;
}

double Riekf::nis(const Linearised& z, int place) {
  expect(z, place);
  double determinant = 1;
  const double nis = mahalanobis2(S(place, place), z.residual, determinant);
  log_det_ = std::log(determinant);
  return nis;
}

/// Cholesky factorisation by 8 x 8 blocks, in place in the lower triangle, with the inverse of L on the
/// diagonal. Returns false if S is not positive definite.
bool Riekf::factorize(int count) {
  for (int j = 0; j < count; ++j) {
    for (int i = j; i < count; ++i) {
      if (i == j) {
        for (int k = 0; k < j; ++k) subtract_square(S(j, k), S(j, j));
        if (!invert_root(S(j, j))) return false;
        continue;
      }
      for (int k = 0; k < j; ++k) S(i, j) -= S(i, k).lazyProduct(S(j, k).transpose());
      S(i, j) = times_upper(S(i, j), S(j, j));
    }
  }
  return true;
}

StateVector Riekf::gain(const Batch& batch, int count, const Eigen::Vector3d& offset, bool expected) {
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  for (int j = 0; j < count && !expected; ++j) expect(batch[at(j)], j);
  for (int j = 0; j < count; ++j) {
    for (int i = j + 1; i < count; ++i)
      S(i, j) = innovation(batch[at(i)], reach_[at(i)], batch[at(j)], reach_[at(j)]);
  }
  sound_ = factorize(count);
  StateVector correction = StateVector::Zero();
  if (!sound_) return correction;
  for (int i = 0; i < count; ++i) {
    Block W = reach_[at(i)].cross.transpose();
    Eigen::Matrix<double, 8, 1> y = batch[at(i)].residual - batch[at(i)].H_pose * offset;
    for (int k = 0; k < i; ++k) {
      W -= S(i, k).lazyProduct(W_[at(k)]);
      y -= S(i, k).lazyProduct(y_[at(k)]);
    }
    W_[at(i)] = lower_times(S(i, i), W);
    y_[at(i)] = S(i, i).lazyProduct(y);
    correction -= W_[at(i)].transpose().lazyProduct(y_[at(i)]);
  }
  return correction;
}

void Riekf::correct(const Batch& batch, int count, const StateVector& correction) {
  if (!sound_) return;
  // With the optimal gain, (11) becomes P - K S K'. W is S^-1/2 times the transpose of the cross-covariance.
  for (int i = 0; i < count; ++i) {
    const Block& W = W_[static_cast<std::size_t>(i)];
    state_.P -= W.transpose().lazyProduct(W);
  }
  state_.P = internal::symmetrized<8>(state_.P);
  correct_correlations(batch, count);
  state_.map_T_base = corrected(correction);
  state_.slow += correction.tail<5>();
}

/// Corrects C, (11).
void Riekf::correct_correlations(const Batch& batch, int count) {
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  for (int i = count - 1; i >= 0; --i) {  // W becomes K'
    Block W = W_[at(i)];
    for (int k = i + 1; k < count; ++k) W -= S(k, i).transpose().lazyProduct(W_[at(k)]);
    W_[at(i)] = upper_times(S(i, i), W);
  }
  Eigen::Matrix<double, 8, 3> KH = Eigen::Matrix<double, 8, 3>::Zero();
  StateByBias mounted = StateByBias::Zero();
  StateVector scaled = StateVector::Zero();
  StateVector by_camera_latency = StateVector::Zero();
  for (int i = 0; i < count; ++i) {
    const Block K = W_[at(i)].transpose();
    KH += K.lazyProduct(H_of(batch[at(i)]));
    mounted += K.lazyProduct(batch[at(i)].H_mount);
    scaled += K.lazyProduct(batch[at(i)].H_scale);
    by_camera_latency += K.lazyProduct(H_camera_latency(batch[at(i)]));
  }
  const auto lose = [&KH](auto C) {
    const Eigen::Matrix<double, 3, decltype(C)::ColsAtCompileTime> top = C.template topRows<3>();
    C -= KH.lazyProduct(top);
  };
  state_.motion -= KH.lazyProduct(Eigen::Matrix<double, 3, 4>(state_.motion.topRows<3>()));
  lose(state_.C.leftCols<6>());
  state_.C.leftCols<6>() -= mounted * mount_.asDiagonal();
  lose(state_.by_systematic.leftCols<kSystematic>());
  state_.by_systematic.leftCols<6>() -= mounted;
  state_.by_systematic.col(6) -= scaled;
  state_.by_systematic.col(7) -= by_camera_latency;
  for (std::size_t l = 0; l < state_.met.size(); ++l) {
    if (state_.met[l] != 0) lose(state_.C.middleCols<6>(6 * (static_cast<Eigen::Index>(l) + 1)));
  }
  for (int i = 0; i < count; ++i) {
    const auto landmark = static_cast<std::size_t>(batch[at(i)].landmark);
    const Block K = W_[at(i)].transpose();
    const StateByBias tagged = K.lazyProduct(batch[at(i)].H_tag);
    state_.C.middleCols<6>(6 * (static_cast<Eigen::Index>(landmark) + 1)) -=
        tagged.lazyProduct(landmarks_[landmark]);
    state_.met[landmark] = 1;
  }
}

}  // namespace waymark
