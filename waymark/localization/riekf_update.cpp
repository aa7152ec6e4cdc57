// What an observation does to the estimate, (8) to (11).
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "waymark/geometry/uncertainty.hpp"
#include "waymark/localization/riekf.hpp"

namespace waymark {
namespace {

using StateByBias = Eigen::Matrix<double, 8, 6>;

/// S = L L' becomes the inverse of L; false when S is not positive definite.
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

/// r' S^-1 r; infinite when S is not positive definite.
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

// Half of a triangle is nothing: products by quarters leave it out, as long as it is a quarter.

/// The lower triangle of S less that of A A'.
void subtract_square(const Block& A, Block& S) {
  S.topLeftCorner<4, 4>() -= A.topRows<4>().lazyProduct(A.topRows<4>().transpose());
  S.bottomRows<4>() -= A.bottomRows<4>().lazyProduct(A.transpose());
}

/// L A, L lower triangular.
Block lower_times(const Block& L, const Block& A) {
  Block LA;
  LA.topRows<4>() = L.topLeftCorner<4, 4>().lazyProduct(A.topRows<4>());
  LA.bottomRows<4>() = L.bottomRows<4>().lazyProduct(A);
  return LA;
}

/// L' A, L lower triangular.
Block upper_times(const Block& L, const Block& A) {
  Block LA;
  LA.topRows<4>() = L.leftCols<4>().transpose().lazyProduct(A);
  LA.bottomRows<4>() = L.bottomRightCorner<4, 4>().transpose().lazyProduct(A.bottomRows<4>());
  return LA;
}

/// A L', L lower triangular.
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

/// An earlier look was from where the robot was then.
Eigen::Matrix<double, 8, 1> Riekf::H_latency(const Linearised& z) const {
  return -z.H_pose.lazyProduct(state_.map_T_base.adjoint() * state_.velocity);
}

StateBySystematic Riekf::sensitivity(const Linearised& z) const {
  StateBySystematic J = H_of(z).lazyProduct(state_.by_systematic.topRows<3>());
  J.leftCols<6>() += z.H_mount;
  J.col(6) += z.H_scale;
  J.col(7) += H_latency(z);
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

// Eigen takes its kernel for large matrices from eight by eight on, which costs more than such a product:
// lazyProduct() multiplies on the spot.
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

/// Cholesky by blocks of eight in place of the lower triangle, the inverse of L on the diagonal; false when S
/// has none.
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
  // With the best gain (11) is P - K S K': W is S^-1/2 of what K is made of.
  for (int i = 0; i < count; ++i) {
    const Block& W = W_[static_cast<std::size_t>(i)];
    state_.P -= W.transpose().lazyProduct(W);
  }
  state_.P = internal::symmetrized<8>(state_.P);
  correct_correlations(batch, count);
  state_.map_T_base = corrected(correction);
  state_.slow += correction.tail<5>();
}

/// C of (11).
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
  StateVector delayed = StateVector::Zero();
  for (int i = 0; i < count; ++i) {
    const Block K = W_[at(i)].transpose();
    KH += K.lazyProduct(H_of(batch[at(i)]));
    mounted += K.lazyProduct(batch[at(i)].H_mount);
    scaled += K.lazyProduct(batch[at(i)].H_scale);
    delayed += K.lazyProduct(H_latency(batch[at(i)]));
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
  state_.by_systematic.col(7) -= delayed;
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
