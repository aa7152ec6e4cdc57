#include "waymark/localization/pose_hypotheses.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/localization/chi_square.hpp"

namespace waymark {
namespace {

/// Squared Mahalanobis distance of two estimates in the left tangent.
double apart(const SE2& a, const SE2& b, const Eigen::Matrix3d& covariance) {
  const SE2::Tangent r = minus(a, b);
  return r.dot(covariance.inverse() * r);
}

double position_variance(const SE2& X, const Eigen::Matrix3d& covariance) {
  return internal::propagate<3>(internal::coordinate_jacobian(X, 1), covariance)
      .topLeftCorner<2, 2>()
      .trace();
}

}  // namespace

void Candidate::add_landmark(int landmark) {
  const auto end = landmarks.begin() + distinct;
  if (distinct < 4 && std::find(landmarks.begin(), end, landmark) == end)
    landmarks[static_cast<std::size_t>(distinct++)] = landmark;
}

PoseHypotheses::PoseHypotheses(const RiekfOptions& options)
    : options_(options), gate3_(chi_square_quantile(0.999, 3)), gate2_(chi_square_quantile(0.999, 2)) {}

void PoseHypotheses::propagate(const Eigen::Vector3d& twist, const Eigen::Vector3d& variances) {
  for (std::size_t i = 0; i < count_; ++i) {
    Candidate& c = all_[i];
    const Eigen::Matrix3d G = c.map_T_base.adjoint();
    c.covariance += G * variances.asDiagonal() * G.transpose();
    c.map_T_base = c.map_T_base * SE2::exp(twist);
  }
}

bool PoseHypotheses::support(Candidate& c, const Observation& observation, const Guesses& guesses,
                             const Landmarks& landmarks, const MountedSensor& sensor) const {
  if (guesses.count == 0) {  // a point
    const auto z = linearise(observation, landmarks, sensor, c.map_T_base);
    if (!z) return false;
    Eigen::Matrix2d S = (z->H_pose * c.covariance * z->H_pose.transpose()).topLeftCorner<2, 2>();
    S.diagonal().array() += 2;
    const Eigen::Vector2d r = z->residual.head<2>();
    return r.dot(S.inverse() * r) < gate2_;
  }
  for (int g = 0; g < guesses.count; ++g) {
    const Guess& guess = guesses.all[static_cast<std::size_t>(g)];
    const Eigen::Matrix3d sum = c.covariance + guess.covariance;
    const double chi2 = apart(guess.map_T_base, c.map_T_base, sum);
    if (!(chi2 < gate3_)) continue;
    const bool known = std::find(c.landmarks.begin(), c.landmarks.begin() + c.distinct,
                                 observation.landmark) != c.landmarks.begin() + c.distinct;
    if (!known) {
      const Eigen::Matrix3d K = c.covariance * sum.inverse();
      c.map_T_base = SE2::exp(K * minus(guess.map_T_base, c.map_T_base)) * c.map_T_base;
      c.covariance = internal::symmetrized<3>((Eigen::Matrix3d::Identity() - K) * c.covariance);
    } else if (position_variance(guess.map_T_base, guess.covariance) <
               position_variance(c.map_T_base, c.covariance)) {
      // The same tag again: its errors stay, so the better view replaces, and is not averaged in.
      c.map_T_base = guess.map_T_base;
      c.covariance = guess.covariance;
    }
    return true;
  }
  return false;
}

void PoseHypotheses::propose(const Guess& guess, int landmark, int other) {
  std::size_t at = count_;
  if (count_ < kMost) {
    ++count_;
  } else {  // the one with the worst record goes
    const auto worst = std::min_element(all_.begin(), all_.end(), [](const Candidate& a, const Candidate& b) {
      const auto score = [](const Candidate& c) { return 2 * c.distinct + c.support - c.against; };
      return score(a) != score(b) ? score(a) < score(b) : a.age < b.age;
    });
    at = static_cast<std::size_t>(worst - all_.begin());
  }
  Candidate c{.map_T_base = guess.map_T_base, .covariance = guess.covariance, .support = 1, .age = clock_};
  c.add_landmark(landmark);
  if (other >= 0) {
    c.add_landmark(other);
    c.points_only = true;
  }
  all_[at] = c;
}

void PoseHypotheses::observe(std::span<const Observation> seen, const Landmarks& landmarks,
                             const MountedSensor& sensor) {
  ++clock_;
  for (const Observation& observation : seen) {
    const Guesses guesses = guesses_of(observation, landmarks, sensor, options_);
    bool supported = false;
    for (std::size_t i = 0; i < count_; ++i) {
      const bool agrees = support(all_[i], observation, guesses, landmarks, sensor);
      if (agrees) {
        ++all_[i].support;
        all_[i].add_landmark(observation.landmark);
        supported = true;
      } else {
        ++all_[i].against;
      }
    }
    if (supported) continue;
    for (int g = 0; g < guesses.count; ++g)
      propose(guesses.all[static_cast<std::size_t>(g)], observation.landmark, -1);
  }
  for (std::size_t i = 0; i + 1 < seen.size(); ++i) {
    for (std::size_t j = i + 1; j < seen.size() && count_ < kMost; ++j) {
      const bool points =
          seen[i].kind != ObservationKind::Corners && seen[i].kind != ObservationKind::PlanarPose &&
          seen[j].kind != ObservationKind::Corners && seen[j].kind != ObservationKind::PlanarPose;
      if (!points) continue;
      const auto guess = guess_of_pair(seen[i], seen[j], landmarks, sensor, options_);
      if (!guess) continue;
      const bool known = std::any_of(
          all_.begin(), all_.begin() + static_cast<std::ptrdiff_t>(count_), [&](const Candidate& c) {
            return apart(guess->map_T_base, c.map_T_base, guess->covariance + c.covariance) < gate3_;
          });
      if (!known) propose(*guess, seen[i].landmark, seen[j].landmark);
    }
  }
}

const Candidate* PoseHypotheses::best() const {
  const Candidate* best = nullptr;
  for (std::size_t i = 0; i < count_; ++i) {
    const Candidate& c = all_[i];
    const auto score = [](const Candidate& x) {
      return 1000 * std::min(x.distinct, 3) + x.support - x.against;
    };
    if (best == nullptr || score(c) > score(*best)) best = &c;
  }
  return best;
}

const Candidate* PoseHypotheses::believable(bool contradicted) const {
  constexpr int kObservations = 4;
  const Candidate* found = best();
  if (found == nullptr) return nullptr;
  const int needed = found->points_only && contradicted ? 3 : 2;
  if (found->distinct < needed || found->support < kObservations || found->support <= found->against)
    return nullptr;
  for (std::size_t i = 0; i < count_; ++i) {
    const Candidate& other = all_[i];
    if (&other == found || other.distinct < 2 || 4 * other.support < 3 * found->support) continue;
    const SE2 between = found->map_T_base.inverse() * other.map_T_base;
    const bool here = between.translation().norm() < 0.15 && std::abs(between.yaw()) < 0.1;
    const bool same =
        here || apart(other.map_T_base, found->map_T_base, other.covariance + found->covariance) < gate3_;
    if (!same) return nullptr;
  }
  return found;
}

}  // namespace waymark
