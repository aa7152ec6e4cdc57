#include "waymark/localization/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include <Eigen/LU>

#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark {
namespace {

/// The p-quantile of the standard normal distribution for p in (0, 1), by bisection of erfc. Meant for
/// options, not for inner loops.
double normal_quantile(double p) {
  double low = -10;
  double high = 10;
  for (int i = 0; i < 80; ++i) {
    const double middle = (low + high) / 2;
    (std::erfc(-middle / std::sqrt(2.0)) / 2 < p ? low : high) = middle;
  }
  return (low + high) / 2;
}

/// The p-quantile of chi-square with n degrees of freedom, accurate to within 2 % for n >= 2 and p <= 0.99999
/// (Wilson and Hilferty, "The Distribution of Chi-Square", PNAS 17, 1931).
double chi_square_quantile(double p, double n) {
  const double a = 2 / (9 * n);
  const double root = 1 - a + normal_quantile(p) * std::sqrt(a);
  return n * root * root * root;
}

/// Squared Mahalanobis distance between two estimates in the left tangent.
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
  if (guesses.count == 0) {  // the landmark is a point
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
      // Repeated observations of the same tag have the same lasting error, so the two are not averaged. The
      // more accurate one replaces the other.
      c.map_T_base = guess.map_T_base;
      c.covariance = guess.covariance;
    }
    return true;
  }
  return false;
}

void PoseHypotheses::propose(const Guess& guess, int landmark, int other) {
  std::size_t at = count_;
  if (count_ < kMaxCandidates) {
    ++count_;
  } else {  // the candidate with the lowest score is replaced
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
    for (std::size_t j = i + 1; j < seen.size() && count_ < kMaxCandidates; ++j) {
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

const Candidate* PoseHypotheses::acceptable(bool contradicted) const {
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

namespace {

constexpr std::size_t kComparisonsKept = 4096;
constexpr Duration kLongAgo = std::chrono::seconds(1);

std::vector<Eigen::Matrix<double, 6, 6>> covariances(const Landmarks& landmarks,
                                                     const RiekfOptions& options) {
  std::vector<Eigen::Matrix<double, 6, 6>> all;
  const double m2 = options.tag_sigma_m * options.tag_sigma_m;
  const double rad2 = options.tag_sigma_rad * options.tag_sigma_rad;
  for (const Landmark& landmark : landmarks.all()) {
    Eigen::Matrix<double, 6, 6> P = landmark.covariance;
    P.diagonal() += (Eigen::Matrix<double, 6, 1>() << m2, m2, m2, rad2, rad2, rad2).finished();
    all.push_back(P);
  }
  return all;
}

}  // namespace

Tracker::Tracker(Landmarks landmarks, MountedSensor sensor, const RiekfOptions& options, ErrorState error)
    : landmarks_(std::move(landmarks)),
      sensor_(std::move(sensor)),
      options_(options),
      filter_(options, error, covariances(landmarks_, options)),
      state_{.pose_hypotheses = PoseHypotheses(options)},
      watch_(landmarks_),
      lasting_(landmarks_.size()),
      systematic_(landmarks_.size()) {
  for (std::size_t n = 1; n < gates_.size(); ++n)
    gates_[n] = chi_square_quantile(options.gate, static_cast<double>(n));
  state_.filter = before_detection_ = filter_.state();
  comparisons_.reserve(kComparisonsKept);
}

void Tracker::save(TrackState& to) const {
  to = state_;
  to.filter = filter_.state();
}

void Tracker::restore(const TrackState& from) {
  state_ = from;
  filter_.set_state(from.filter);
  while (!trace_.empty() && trace_.back().stamp > from.stamp) trace_.pop_back();
}

void Tracker::start_at(SensorTime stamp) {
  state_.stamp = stamp;
  state_.started = true;
}

void Tracker::start_from(const SE2& map_T_base, double sigma_m, double sigma_rad) {
  const Eigen::Matrix3d P =
      Eigen::Vector3d(sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad).asDiagonal();
  filter_.start(map_T_base, from_coordinate_covariance(map_T_base, P).covariance, true);
  state_.mode = TrackMode::Certain;
  state_.given = true;
  ++state_.starts;
}

void Tracker::advance(const MotionStep& measured, SensorTime to) {
  constexpr double kNoWay_m = 1e-7;
  MotionStep step = measured;
  state_.stamp = to;
  if (state_.wheels_stuck || state_.halt.suspected())
    step.jumped = false;  // the encoders have resumed, so their step contains a gap
  if (!trust_standstill_) step = state_.halt.advance(step);
  state_.no_translation = step.twist.head<2>().norm() < kNoWay_m && !step.jumped;
  state_.wheels_stuck = state_.wheels_stuck && state_.no_translation;
  if (state_.wheels_stuck) {  // random walk of 2 cm between images
    constexpr double kWalk_m2_s = 6e-3;
    constexpr double kWalk_rad2_s = 1e-3;
    step.standing = false;
    step.extra_m2 += kWalk_m2_s * step.dt_s;
    step.extra_rad2 += kWalk_rad2_s * step.dt_s;
  }
  if (step.jumped) {  // the accepted observations belong to another place or drive
    state_.mode = TrackMode::Lost;
    state_.contradicted = false;
    state_.contradicting_frames = 0;
    state_.pose_hypotheses.clear();
    return;
  }
  // The drift of a candidate is 5 % of the distance, 0.05 rad/m, and 5 % of a turn, which is deliberately
  // coarse.
  const double drift = 2.5e-3 * step.twist.norm() * std::max(step.twist.norm(), 0.02) + 1e-6 * step.dt_s;
  state_.pose_hypotheses.propagate(step.twist,
                                   {drift + step.extra_m2, drift + step.extra_m2, drift + step.extra_rad2});
  if (state_.mode == TrackMode::Lost) return;
  if (step.standing && step.twist.z() != 0)
    filter_.observe_zero_velocity(step.twist.z() / step.dt_s,
                                  std::max(1e-4, options_.motion.yaw_rad_sqrt_s) / std::sqrt(step.dt_s));
  filter_.propagate(step);
  if (tracing_) keep_step(to);
}

void Tracker::keep_trace(Duration lag) {
  constexpr Duration kLate = std::chrono::seconds(1);
  constexpr double kStepsPerSecond = 400;
  tracing_ = true;
  trace_kept_ = lag + kLate;
  // Twice the capacity, because the oldest steps are erased in one block.
  trace_.reserve(static_cast<std::size_t>(2 * kStepsPerSecond * to_seconds(*trace_kept_)));
}

void Tracker::keep_step(SensorTime to) {
  if (trace_kept_ && trace_.size() == trace_.capacity()) {
    const auto young =
        std::ranges::lower_bound(trace_, trace_.back().stamp - *trace_kept_, {}, &TraceStep::stamp);
    const auto half = trace_.begin() + static_cast<std::ptrdiff_t>(trace_.size() / 2);
    trace_.erase(trace_.begin(), std::max(young, half));
  }
  TraceStep kept{.stamp = to, .chain = state_.starts, .transition = filter_.last_transition()};
  kept.motion_cross_covariance = filter_.last_motion_cross_covariance();
  kept.predicted = filter_.state().map_T_base;
  kept.predicted_slow = filter_.state().slow;
  kept.predicted_P = filter_.conditional_covariance();
  trace_.push_back(kept);
  keep_filtered();
}

void Tracker::keep_filtered() {
  if (!tracing_ || trace_.empty() || trace_.back().stamp != state_.stamp) return;
  TraceStep& kept = trace_.back();
  kept.certain = state_.mode == TrackMode::Certain;
  kept.filtered = filter_.state().map_T_base;
  kept.filtered_slow = filter_.state().slow;
  kept.filtered_P = filter_.conditional_covariance();
  kept.lasting_P = (filter_.state().P - kept.filtered_P).topLeftCorner<3, 3>();
}

void Tracker::report(const FrameObservations& frame, const Observation& observation, const Linearised& z,
                     double nis, bool accepted, int place) {
  if (frame.reported) return;
  const Landmark& landmark = landmarks_[observation.landmark];
  if (comparisons_.size() < kComparisonsKept)
    comparisons_.push_back({frame.stamp, landmark.tag, nis, z.rows,
                            accepted && watch_.usable(observation.landmark), filter_.log_det()});
  if (!accepted) return report_contradiction(frame, observation);
  watch_.add({.landmark = observation.landmark, .nis_per_row = nis / z.rows, .accepted = true});
  if (state_.mode != TrackMode::Certain || state_.given) return;
  lasting_.add(z, filter_.innovation_covariance(place));
  sees_corners_ = sees_corners_ || observation.kind == ObservationKind::Corners;
  learn_systematic(z, place);
}

void Tracker::learn_systematic(const Linearised& z, int place) {
  constexpr int kBetweenVerdicts = 250;
  constexpr int kBeforeFirst = 500;
  systematic_.add(z, filter_.sensitivity(z), filter_.innovation_covariance(place), state_.stamp);
  if (systematic_.count() < std::max(next_verdict_, kBeforeFirst)) return;
  next_verdict_ = systematic_.count() + kBetweenVerdicts;
  const auto verdict = test_systematic(systematic_);
  if (verdict || !suspected_before_) suspect_ = verdict;
}

void Tracker::forget_systematic() {
  systematic_.clear();
  suspect_.reset();
  suspected_before_ = false;
  next_verdict_ = 0;
}

void Tracker::report_contradiction(const FrameObservations& frame, const Observation& observation) {
  const auto base_p = base_p_landmark(observation, landmarks_, sensor_);
  if (frame.reported || !base_p) return;
  const SE2& X = filter_.state().map_T_base;
  const SE2 map_T_eye = X * project_to_plane(sensor_.base_T(observation.camera));
  const Eigen::Vector2d map_p = landmarks_[observation.landmark].map_T_tag.translation().head<2>();
  WatchedObservation seen{.landmark = observation.landmark, .map_p_implied = X * *base_p};
  const Eigen::Vector2d measured = seen.map_p_implied - map_T_eye.translation();
  const Eigen::Vector2d expected = map_p - map_T_eye.translation();
  seen.range_ratio = measured.norm() / std::max(1e-6, expected.norm());
  seen.off_direction_rad =
      std::atan2(expected.x() * measured.y() - expected.y() * measured.x(), expected.dot(measured));
  watch_.add(seen);
}

Tracker::Verdict Tracker::gate(FrameObservations& frame) {
  Verdict verdict;
  for (std::size_t i = 0; i < frame.count; ++i) {
    const Observation& observation = frame.seen[i];
    const auto z = linearise(observation, landmarks_, sensor_, filter_.state().map_T_base);
    const bool usable = watch_.usable(observation.landmark);
    if (!z) {  // it is not visible from the estimated pose, so its map position is far off
      report_contradiction(frame, observation);
      if (usable) ++verdict.rejected_count;
      continue;
    }
    const int place = static_cast<int>(std::min<std::size_t>(verdict.accepted_count, Riekf::kMaxBatch - 1));
    const double nis = filter_.nis(*z, place);
    const bool accepted = nis <= gates_[static_cast<std::size_t>(z->rows)];
    report(frame, observation, *z, nis, accepted, place);
    if (!usable) continue;
    if (accepted) {
      accepted_linearised_[verdict.accepted_count] = *z;
      verdict.accepted[verdict.accepted_count++] = &observation;
    } else {
      ++verdict.rejected_count;
    }
  }
  return verdict;
}

/// Iterates if the correction is so large that the measurement function is not linear over it (Bell and
/// Cathey, "The Iterated Kalman Filter Update as a Gauss-Newton Method", IEEE TAC 38(2), 1993).
void Tracker::update(const Verdict& verdict) {
  constexpr int kIterations = 4;
  for (std::size_t first = 0; first < verdict.accepted_count; first += Riekf::kMaxBatch) {
    const std::size_t last = std::min(verdict.accepted_count, first + Riekf::kMaxBatch);
    SE2 at = filter_.state().map_T_base;
    const SE2 prior = at;
    StateVector correction = StateVector::Zero();
    int count = 0;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      Riekf::Batch& batch = batch_;
      count = 0;
      const bool as_gated = first == 0 && iteration == 0;
      for (std::size_t i = first; i < last; ++i) {
        if (as_gated) {
          batch[static_cast<std::size_t>(count++)] = accepted_linearised_[i];
          continue;
        }
        const auto z = linearise(*verdict.accepted[i], landmarks_, sensor_, at);
        if (z) batch[static_cast<std::size_t>(count++)] = *z;
      }
      if (count == 0) return;
      const Eigen::Vector3d offset = minus(at, prior);
      // gate() has evaluated nis() for each observation at its place in the batch; rejected observations come
      // after them.
      const bool expected = as_gated && verdict.accepted_count < Riekf::kMaxBatch;
      correction = filter_.gain(batch, count, offset, expected);
      const SE2 next = filter_.corrected(correction);
      const Eigen::Vector3d moved = minus(next, at);
      at = next;
      constexpr double kLinearRange = 0.002;  // [m, rad]
      const double size = std::max((next.translation() - prior.translation()).norm(), std::abs(moved.z()));
      if (size < kLinearRange || (iteration > 0 && moved.norm() < 1e-6)) break;
    }
    filter_.correct(batch_, count, correction);
  }
}

/// Whether all tags in a frame that are not under suspicion fit the estimate or, if `most_contradict` is set,
/// whether most of them do not.
bool Tracker::all_fit(const FrameObservations& frame, bool most_contradict) {
  int fits = 0;
  int usable = 0;
  for (std::size_t i = 0; i < frame.count; ++i) {
    const Observation& observation = frame.seen[i];
    if (!watch_.usable(observation.landmark)) continue;
    ++usable;
    const auto z = linearise(observation, landmarks_, sensor_, filter_.state().map_T_base);
    if (z && filter_.nis(*z, 0) <= gates_[static_cast<std::size_t>(z->rows)]) ++fits;
  }
  constexpr int kMinUsable = 2;
  return usable >= kMinUsable && (most_contradict ? 2 * fits < usable : fits == usable);
}

/// Detects encoders that report standstill while the robot is driving. Most tags then contradict the
/// standstill, and all of them agree that the robot has moved a few centimetres since the previous frame.
void Tracker::detect_stuck_wheels(const FrameObservations& frame, double since_s) {
  constexpr double kFastest_m_s = 0.5;
  constexpr double kFastest_rad_s = 0.5;
  constexpr double kMoment_s = 0.3;
  if (trust_standstill_ || !state_.no_translation || state_.wheels_stuck || state_.given ||
      state_.mode != TrackMode::Certain)
    return;
  if (!(since_s > 0 && since_s < kMoment_s) || !all_fit(frame, true)) return;
  before_detection_ = filter_.state();
  filter_.propagate(
      {.extra_m2 = std::pow(kFastest_m_s * since_s, 2), .extra_rad2 = std::pow(kFastest_rad_s * since_s, 2)});
  state_.wheels_stuck = all_fit(frame, false);
  if (!state_.wheels_stuck) return filter_.set_state(before_detection_);
  if (tracing_) keep_step(state_.stamp);
}

void Tracker::process(FrameObservations& frame) {
  if (options_.camera_readout_s != 0 && state_.mode != TrackMode::Lost) {
    const RiekfState& now = filter_.state();
    for (std::size_t i = 0; i < frame.count; ++i)
      bring_to_middle(frame.seen[i], landmarks_, sensor_, now.map_T_base, now.velocity,
                      options_.camera_readout_s);
  }
  detect_stuck_wheels(frame, to_seconds(frame.stamp - std::max(state_.frame_stamp, frame.stamp - kLongAgo)));
  state_.frame_stamp = frame.stamp;
  state_.frame_number = frame.number;
  if (state_.mode == TrackMode::Lost) {
    search(frame);
  } else {
    const Verdict verdict = gate(frame);
    // A frame is rejected as a whole if most of its observations contradict the estimate.
    if (verdict.accepted_count >= verdict.rejected_count) {
      const SE2 predicted = filter_.state().map_T_base;
      update(verdict);
      if (verdict.accepted_count > 0)
        state_.halt.observe_correction(
            (filter_.state().map_T_base.translation() - predicted.translation()).norm());
    }
    check_sound();
    update_mode(verdict, frame);
  }
  frame.reported = true;
  keep_filtered();
}

/// Resets the filter if the state is not finite, so that no input produces a NaN.
void Tracker::check_sound() {
  const RiekfState& s = filter_.state();
  const bool sound = s.map_T_base.matrix().allFinite() && s.P.allFinite() && s.slow.allFinite() &&
                     s.P.diagonal().minCoeff() >= 0;
  if (sound) return;
  ++broken_;
  filter_.start({}, Eigen::Matrix3d::Identity(), false);
  state_.mode = TrackMode::Lost;
  state_.pose_hypotheses.clear();
}

std::optional<LocalizationEstimate> Tracker::estimate() const {
  if (state_.mode == TrackMode::Lost) {
    const Candidate* guess = state_.pose_hypotheses.best();
    if (guess == nullptr) return std::nullopt;
    return LocalizationEstimate{state_.stamp, guess->map_T_base,
                                coordinate_covariance(Uncertain<SE2>{guess->map_T_base, guess->covariance}),
                                false};
  }
  Uncertain<SE2> map_X_base{filter_.state().map_T_base, filter_.covariance()};
  if (suspect_ && suspected_before_) map_X_base.covariance += filter_.covariance_of(suspect_->second_moment);
  LocalizationEstimate estimate{state_.stamp, map_X_base.mean, coordinate_covariance(map_X_base)};
  estimate.certain = state_.mode == TrackMode::Certain && !state_.given &&
                     estimate.position_sigma_m() < options_.certain_sigma_m;
  estimate.contradicting_frames = state_.contradicting_frames;
  return estimate;
}

// Transitions between the states lost, uncertain and certain.

void Tracker::restart_from(const GivenPose& given) {
  restarts_ += state_.starts > 0 ? 1 : 0;
  filter_.start(given.map_T_base, from_coordinate_covariance(given.map_T_base, given.covariance).covariance,
                true);
  state_.mode = TrackMode::Certain;
  state_.given = true;
  state_.contradicted = false;
  state_.contradicting_frames = 0;
  state_.wheels_stuck = false;
  state_.halt = {};
  state_.pose_hypotheses.clear();
  watch_.forget_pending();
  ++state_.starts;
}

void Tracker::search(const FrameObservations& frame) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < frame.count; ++i) {
    if (watch_.usable(frame.seen[i].landmark)) usable_[count++] = frame.seen[i];
  }
  state_.pose_hypotheses.observe(std::span(usable_.data(), count), landmarks_, sensor_);
  const Candidate* found = state_.pose_hypotheses.acceptable(state_.mode != TrackMode::Lost);
  if (found == nullptr) return;
  filter_.start(found->map_T_base, found->covariance, state_.mode != TrackMode::Lost);
  int used = 0;
  for (std::size_t i = 0; i < count && used < Riekf::kMaxBatch; ++i) {
    const auto z = linearise(usable_[i], landmarks_, sensor_, found->map_T_base);
    if (z) batch_[static_cast<std::size_t>(used++)] = *z;
  }
  filter_.start_moved_by_systematic(batch_, used);
  state_.mode = TrackMode::Certain;
  state_.given = false;
  state_.contradicted = false;
  state_.contradicting_frames = 0;
  ++state_.starts;
  state_.pose_hypotheses.clear();
  watch_.forget_pending();
}

void Tracker::update_mode(const Verdict& verdict, const FrameObservations& frame) {
  if (verdict.accepted_count == 0 && verdict.rejected_count == 0) return;
  const bool agrees = verdict.accepted_count > 0 && verdict.accepted_count >= verdict.rejected_count;
  if (state_.given) {
    state_.given = false;
    if (!agrees) {
      if (!frame.reported) ++refused_starts_;
      state_.mode = TrackMode::Uncertain;
    }
  }
  agrees ? count_agreement(verdict) : count_contradiction(frame);
}

void Tracker::count_contradiction(const FrameObservations& frame) {
  ++state_.contradicting_frames;
  if (!state_.contradicted) {
    state_.contradicted = true;
    state_.contradicted_since = frame.stamp;
    state_.pose_hypotheses.clear();
  }
  state_.agreeing_frames = 0;
  state_.agreeing_distinct = 0;
  if (to_seconds(frame.stamp - state_.contradicted_since) >= options_.uncertain_after_s)
    state_.mode = TrackMode::Uncertain;
  search(frame);
}

/// The estimate is certain once several frames have agreed, with at least two distinct tags among them.
void Tracker::count_agreement(const Verdict& verdict) {
  state_.contradicting_frames = 0;
  if (state_.mode == TrackMode::Certain) {
    state_.contradicted = false;
    watch_.confirm();
    return;
  }
  ++state_.agreeing_frames;
  for (std::size_t i = 0; i < verdict.accepted_count; ++i) {
    const int landmark = verdict.accepted[i]->landmark;
    if (state_.agreeing_distinct == 0 || (state_.agreeing_distinct == 1 && state_.agreeing[0] != landmark))
      state_.agreeing[static_cast<std::size_t>(state_.agreeing_distinct++)] = landmark;
  }
  constexpr int kLooks = 3;
  if (state_.agreeing_frames < kLooks || state_.agreeing_distinct < 2) return;
  state_.mode = TrackMode::Certain;
  state_.contradicted = false;
  watch_.confirm();
}

}  // namespace waymark
