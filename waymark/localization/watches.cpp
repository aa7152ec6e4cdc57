#include "waymark/localization/watches.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

constexpr int kMinContradictions = 15;  // confirmed contradictions before a landmark is excluded
constexpr int kFitsAgain = 30;          // consecutive observations that must fit before it is used again

}  // namespace

TagWatch::TagWatch(const Landmarks& landmarks)
    : landmarks_(landmarks), all_(static_cast<std::size_t>(landmarks.size())) {}

void TagWatch::Sums::add(const WatchedObservation& seen) {
  ++count;
  p += seen.map_p_implied;
  p2 += seen.map_p_implied.squaredNorm();
  ratio += seen.range_ratio;
  ratio2 += seen.range_ratio * seen.range_ratio;
  direction += std::abs(seen.off_direction_rad);
}

void TagWatch::Sums::add(const Sums& other) {
  count += other.count;
  p += other.p;
  p2 += other.p2;
  ratio += other.ratio;
  ratio2 += other.ratio2;
  direction += other.direction;
}

void TagWatch::add(const WatchedObservation& seen) {
  One& one = all_[static_cast<std::size_t>(seen.landmark)];
  ++one.seen;
  one.accepted_in_a_row = seen.accepted ? one.accepted_in_a_row + 1 : 0;
  if (seen.accepted) {
    ++one.accepted;
    one.nis_sum += seen.nis_per_row;
  } else {
    one.pending.add(seen);
  }
  if (one.excluded && one.accepted_in_a_row >= kFitsAgain) {
    one.excluded = false;
    one.wrong = {};
  }
}

void TagWatch::confirm() {
  for (One& one : all_) {
    if (one.pending.count == 0) continue;
    one.wrong.add(one.pending);
    one.pending = {};
    // A tag that mostly fits is occasionally misread, but the gate rejects those observations.
    const bool mostly_wrong = one.wrong.count > one.accepted;
    if (one.wrong.count >= kMinContradictions && mostly_wrong) one.excluded = true;
  }
}

void TagWatch::forget_pending() {
  for (One& one : all_) one.pending = {};
}

double TagWatch::mean_nis_per_row(int landmark) const {
  const One& one = at(landmark);
  return one.accepted > 0 ? one.nis_sum / one.accepted : 0;
}

std::string TagWatch::name(int landmark) const {
  const Landmark& it = landmarks_[landmark];
  return it.family_known ? to_string(it.tag) : fmt::format("tag {}", it.tag.number);
}

bool TagWatch::swapped(int a, int b) const {
  if (!at(a).excluded || !at(b).excluded) return false;
  const Eigen::Vector2d map_a = landmarks_[a].map_T_tag.translation().head<2>();
  const Eigen::Vector2d map_b = landmarks_[b].map_T_tag.translation().head<2>();
  const double tolerance_m = std::max(0.15, 0.4 * (map_a - map_b).norm());
  const Eigen::Vector2d seen_a = at(a).wrong.p / at(a).wrong.count;
  const Eigen::Vector2d seen_b = at(b).wrong.p / at(b).wrong.count;
  return (seen_a - map_b).norm() < tolerance_m && (seen_b - map_a).norm() < tolerance_m &&
         (seen_a - map_b).norm() < (seen_a - map_a).norm() &&
         (seen_b - map_a).norm() < (seen_b - map_b).norm();
}

std::string TagWatch::describe(int landmark) const {
  const Sums& wrong = at(landmark).wrong;
  const Landmark& it = landmarks_[landmark];
  const double n = wrong.count;
  const Eigen::Vector2d mean = wrong.p / n;
  const double spread_m = std::sqrt(std::max(0.0, wrong.p2 / n - mean.squaredNorm()));
  const double moved_m = (mean - it.map_T_tag.translation().head<2>()).norm();
  const double ratio = wrong.ratio / n;
  const double ratio_spread = std::sqrt(std::max(0.0, wrong.ratio2 / n - ratio * ratio));
  const bool same_direction = wrong.direction / n < 0.05;
  // If the size is wrong, all distances are scaled by the same ratio, unlike with a map position that is
  // kilometres off.
  const bool same_ratio = ratio_spread < 0.3 * std::min(std::abs(ratio - 1), ratio);
  if (it.size_m > 0 && same_direction && std::abs(ratio - 1) > 0.08 && same_ratio)
    return fmt::format(
        "{} seems to measure {:.3f} m instead of {:.3f} m and is not used. Measure its black square and "
        "correct "
        "its size in the map",
        name(landmark), it.size_m / ratio, it.size_m);
  if (spread_m < 0.5 * moved_m)
    return fmt::format(
        "{} is {:.2f} m from its position in the map, near ({:.2f}, {:.2f}), and is not used. Move it back, "
        "correct the map, or extend the map with a lap that observes the tag",
        name(landmark), moved_m, mean.x(), mean.y());
  return fmt::format(
      "{} is observed at inconsistent positions (several tags with this number, or misread) and is not used. "
      "Give the other tags different numbers",
      name(landmark));
}

/// A duplicate tag is observed in its map position and, about as often, in one other position.
std::optional<std::string> TagWatch::describe_duplicate(int landmark) const {
  const One& one = at(landmark);
  constexpr double kShare = 0.25;
  if (one.excluded || one.wrong.count < kMinContradictions || one.wrong.count < kShare * one.seen)
    return std::nullopt;
  const Eigen::Vector2d mean = one.wrong.p / one.wrong.count;
  const double spread_m = std::sqrt(std::max(0.0, one.wrong.p2 / one.wrong.count - mean.squaredNorm()));
  const double apart_m = (mean - landmarks_[landmark].map_T_tag.translation().head<2>()).norm();
  if (spread_m > 0.5 * apart_m) return std::nullopt;
  return fmt::format(
      "duplicate {}: observed at its position in the map and {:.2f} m from it, near ({:.2f}, {:.2f}), or "
      "moved "
      "during the drive. Observations at the second position are not used. Give one of the two tags another "
      "number",
      name(landmark), apart_m, mean.x(), mean.y());
}

std::vector<std::string> TagWatch::findings() const {
  std::vector<std::string> all;
  std::vector<bool> reported(all_.size(), false);
  for (int a = 0; a < landmarks_.size(); ++a) {
    if (auto second = describe_duplicate(a)) all.push_back(std::move(*second));
    if (!at(a).excluded || reported[static_cast<std::size_t>(a)]) continue;
    for (int b = a + 1; b < landmarks_.size(); ++b) {
      if (!swapped(a, b)) continue;
      all.push_back(fmt::format(
          "{} and {} are swapped, in the map or on the wall, and are not used. Swap them back, or "
          "extend the map with a lap that observes both",
          name(a), name(b)));
      reported[static_cast<std::size_t>(a)] = reported[static_cast<std::size_t>(b)] = true;
    }
    if (!reported[static_cast<std::size_t>(a)]) all.push_back(describe(a));
  }
  return all;
}

namespace {

constexpr double kHaltMinStep_m = 1e-7;
constexpr double kHardestStop_m_s2 = 8;    // tyres slip before a robot stops this hard
constexpr double kHaltMinSpeed_m_s = 0.1;  // at lower speeds, coarse encoders seem to stop between two ticks
constexpr double kHaltMinTime_s = 0.05;    // the motion during a shorter time is below the noise of tags
constexpr double kHaltMaxCorrectionShare = 0.3;  // share of the suspected motion; smaller at standstill

}  // namespace

MotionStep SuddenHalt::advance(MotionStep step) {
  const double distance_m = step.twist.head<2>().norm();
  if (step.dt_s <= 0) return step;
  if (distance_m > kHaltMinStep_m || step.jumped) {
    *this = {};
    speed_m_s_ = distance_m / step.dt_s;
    yaw_rate_rad_s_ = step.twist.z() / step.dt_s;
    return step;
  }
  const double period_s = step.dt_s / step.share;
  suspected_ = suspected_ || (speed_m_s_ > kHaltMinSpeed_m_s && speed_m_s_ > kHardestStop_m_s2 * period_s);
  if (!suspected_) {
    speed_m_s_ = 0;
    return step;
  }
  const double before_s = since_s_;
  since_s_ += step.dt_s;
  const double grown_s2 = since_s_ * since_s_ - before_s * before_s;
  step.extra_m2 += speed_m_s_ * speed_m_s_ * grown_s2;
  if (step.twist.z() == 0) step.extra_rad2 += yaw_rate_rad_s_ * yaw_rate_rad_s_ * grown_s2;
  step.standing = false;
  return step;
}

void SuddenHalt::observe_correction(double moved_m) {
  if (!suspected_) return;
  const bool at_standstill =
      since_s_ > kHaltMinTime_s && moved_m < kHaltMaxCorrectionShare * speed_m_s_ * since_s_;
  if (at_standstill) *this = {};
  since_s_ = 0;
}

void LastingErrors::add(const Linearised& z, const Eigen::Matrix<double, 8, 8>& S) {
  constexpr int kOneMean = 30;
  Sums& sums = all_[static_cast<std::size_t>(z.landmark)];
  sums.residual += z.residual;
  sums.S += S;
  if (++sums.count < kOneMean) return;
  const double n = sums.count;
  const Eigen::Matrix<double, 8, 1> mean = sums.residual / n;
  Eigen::Matrix<double, 8, 8> expected = sums.S / n;
  expected.diagonal().array() += 1 / n - 1;
  const Eigen::LLT<Eigen::Matrix<double, 8, 8>> llt(expected);
  if (llt.info() == Eigen::Success) {
    const double nis = mean.dot(llt.solve(mean));
    constexpr double kCapPerRow = 16;
    nis_ += nis;
    cost_ += std::min(nis, kCapPerRow * z.rows);
    for (Eigen::Index i = 0; i < z.rows; ++i) cost_ += 2 * std::log(llt.matrixLLT()(i, i));
    degrees_of_freedom_ += z.rows;
    ++means_;
  }
  sums = {};
}

std::optional<double> LastingErrors::mean() const {
  constexpr int kMinMeans = 20;
  if (means_ < kMinMeans) return std::nullopt;
  return nis_ / degrees_of_freedom_;
}

namespace {

constexpr std::int64_t kMoment_ns = 2'000'000'000;  ///< longer than slip and the memory of a filter last

/// Jackknife variances of a value, computed from the shift of the maximum when each group is omitted in turn.
/// They are scaled by the ratio between the variances of Student's t and a normal distribution, because the
/// spread is poorly estimated from few groups.
template <class Groups>
SystematicVector jackknife(const SystematicMatrix& information, const SystematicVector& value,
                           const Groups& groups) {
  constexpr double kMinGroups = 4;
  const auto count = static_cast<double>(groups.size());
  if (count < kMinGroups) return SystematicVector::Zero();
  SystematicVector squares = SystematicVector::Zero();
  for (const auto& [key, group] : groups) {
    const SystematicMatrix others = information - group.information;
    const SystematicVector moved = others.ldlt().solve(group.information * value - group.score);
    squares += moved.cwiseAbs2();
  }
  return (count - 1) / (count - 3) * (count - 1) / count * squares;
}

}  // namespace

ScoreSums& ScoreSums::operator+=(const ScoreSums& other) {
  information += other.information;
  score += other.score;
  count += other.count;
  return *this;
}

void ScoreClusters::add(int landmark, SensorTime stamp, const ScoreSums& score) {
  sums_[{stamp.time_since_epoch().count() / kMoment_ns, landmark}] += score;
}

SystematicVector ScoreClusters::variances(const SystematicMatrix& information,
                                          const SystematicVector& value) const {
  std::map<std::int64_t, ScoreSums> moments;
  std::map<int, ScoreSums> landmarks;
  for (const auto& [key, sums] : sums_) {
    moments[key.first] += sums;
    landmarks[key.second] += sums;
  }
  const SystematicVector by_moment = jackknife(information, value, moments);
  const SystematicVector by_landmark = jackknife(information, value, landmarks);
  const SystematicVector by_both = jackknife(information, value, sums_);
  return (by_moment + by_landmark - by_both).cwiseMax(by_moment).cwiseMax(by_landmark);
}

void SystematicErrors::add(const Linearised& z, const StateBySystematic& A,
                           const Eigen::Matrix<double, 8, 8>& S, SensorTime stamp) {
  if (!counts_) return;
  const Eigen::LLT<Eigen::Matrix<double, 8, 8>> llt(S);
  if (llt.info() != Eigen::Success) return;
  const StateBySystematic white_A = llt.matrixL().solve(A);
  const Eigen::Matrix<double, 8, 1> white_r = llt.matrixL().solve(z.residual);
  if (!white_A.allFinite() || !white_r.allFinite()) return;
  if (count_ == per_block_ * static_cast<int>(kBlocks)) merge_blocks();
  const Sums score{white_A.transpose().lazyProduct(white_A), white_A.transpose().lazyProduct(white_r), 1};
  blocks_[static_cast<std::size_t>(count_ / per_block_)] += score;
  if (clusters_) clusters_->add(z.landmark, stamp, score);
  ++count_;
  seen_[static_cast<std::size_t>(z.landmark)] = 1;
}

/// Merges neighbouring blocks, so that there are half as many, each twice as long.
void SystematicErrors::merge_blocks() {
  for (std::size_t i = 0; i < kBlocks / 2; ++i) {
    Sums both = blocks_[2 * i];
    both += blocks_[2 * i + 1];
    blocks_[i] = both;
  }
  std::fill(blocks_.begin() + kBlocks / 2, blocks_.end(), Sums{});
  per_block_ *= 2;
}

void SystematicErrors::clear() {
  std::ranges::fill(seen_, std::uint8_t{0});
  std::ranges::fill(blocks_, Sums{});
  per_block_ = kFirstBlock;
  count_ = 0;
  if (clusters_) clusters_.emplace();
}

std::optional<SystematicFit> SystematicErrors::fit(const SystematicVector& prior,
                                                   const SystematicVector& away) const {
  constexpr int kMinObservations = 100;
  constexpr int kMinLandmarks = 3;
  SystematicMatrix information = prior.cwiseAbs2().cwiseInverse().asDiagonal();
  SystematicVector score = -information.diagonal().cwiseProduct(away);
  for (const Sums& sums : blocks_) {
    information += sums.information;
    score += sums.score;
  }
  if (count_ < kMinObservations || std::ranges::count(seen_, 1) < kMinLandmarks) return std::nullopt;
  const Eigen::LLT<SystematicMatrix> llt(information);
  if (llt.info() != Eigen::Success) return std::nullopt;
  SystematicFit fit{.value = llt.solve(score)};
  fit.covariance = llt.solve(SystematicMatrix::Identity());
  const SystematicVector apart =
      clusters_ ? clusters_->variances(information, fit.value) : variances_by_blocks(fit);
  const SystematicVector more = (apart.array() / fit.covariance.diagonal().array()).max(1).sqrt();
  fit.covariance = (more.asDiagonal() * fit.covariance * more.asDiagonal()).eval();
  return fit;
}

/// Variances from the scatter of the blocks; zero if there are too few blocks.
SystematicVector SystematicErrors::variances_by_blocks(const SystematicFit& by_number) const {
  constexpr double kMinBlocks = 4;
  double blocks = 0;
  SystematicMatrix scatter = SystematicMatrix::Zero();
  for (const Sums& sums : blocks_) {
    const SystematicVector s = sums.score - sums.information * by_number.value;
    scatter += s * s.transpose();
    blocks += sums.count > 0 ? 1 : 0;
  }
  if (blocks < kMinBlocks) return SystematicVector::Zero();
  const SystematicMatrix P = by_number.covariance * scatter * by_number.covariance;
  return blocks / (blocks - 1) * P.diagonal();
}

namespace {

/// The rows of kSystematic that belong to one suspect.
struct Group {
  Suspect suspect;
  Eigen::Index first;
  Eigen::Index size;
};

constexpr std::array kGroups{Group{Suspect::Mounting, 0, 6}, Group{Suspect::Scale, 6, 1},
                             Group{Suspect::CameraLatency, 7, 1}};
/// Errors of sensor parameters [m, rad, 1, s] below which the stated covariance covers their effect.
constexpr std::array kNegligible{0.008, 0.008, 0.008, 0.01, 0.01, 0.01, 0.006, 0.01};

/// The largest chi-square (with one degree of freedom) among the parameters in a group that exceed
/// kNegligible.
double wald(const SystematicFit& fit, const Group& group) {
  double most = 0;
  for (Eigen::Index i = group.first; i < group.first + group.size; ++i) {
    if (std::abs(fit.value[i]) > kNegligible[static_cast<std::size_t>(i)])
      most = std::max(most, fit.value[i] * fit.value[i] / fit.covariance(i, i));
  }
  return most;
}

SystematicVector prior_of_any_robot() {
  return (SystematicVector() << 0.1, 0.1, 0.05, 0.1, 0.1, 0.1, 0.05, 0.1, 0.05, 0.05).finished();
}

/// The part of the innovations that a suspect explains if all other parameters are correct.
double explained_alone(const SystematicErrors& errors, const Group& group) {
  constexpr double kExactSigma = 1e-9;
  SystematicVector prior = prior_of_any_robot();
  for (Eigen::Index i = 0; i < 8; ++i)
    if (i < group.first || i >= group.first + group.size) prior[i] = kExactSigma;
  const auto fit = errors.fit(prior);
  return fit ? wald(*fit, group) : 0;
}

}  // namespace

std::optional<SystematicVerdict> test_systematic(const SystematicErrors& errors) {
  const auto fit = errors.fit(prior_of_any_robot());
  if (!fit) return std::nullopt;
  constexpr double kSignificant = 30;
  std::optional<SystematicVerdict> verdict;
  double most = 0;
  for (const Group& group : kGroups) {
    const double chi2 = wald(*fit, group);
    if (chi2 < kSignificant) continue;
    const double alone = explained_alone(errors, group);
    if (verdict && alone <= most) continue;
    most = alone;
    verdict = SystematicVerdict{.suspect = group.suspect, .chi2 = chi2, .fit = *fit};
  }
  if (!verdict) return verdict;
  constexpr Eigen::Index kOfSensor = 8;
  verdict->second_moment.topLeftCorner<kOfSensor, kOfSensor>() =
      (fit->covariance + fit->value * fit->value.transpose()).topLeftCorner<kOfSensor, kOfSensor>();
  return verdict;
}

std::string describe(const SystematicVerdict& verdict, bool corners) {
  const SystematicVector& v = verdict.fit.value;
  switch (verdict.suspect) {
    case Suspect::Mounting:
      return fmt::format(
          "the innovations show a wrong sensor mounting: by about x {:.0f} mm, y {:.0f} mm, yaw {:.1f} deg, "
          "pitch {:.1f} deg. Run `waymark calibrate robot` and pass the result with `calibration`",
          1000 * v[0], 1000 * v[1], to_degrees(v[5]), to_degrees(v[4]));
    case Suspect::Scale:
      return fmt::format(
          "the innovations show a wrong {}: by about {:+.1f} %. Run `waymark calibrate {}` and pass the "
          "result with `calibration`",
          corners ? "focal length, or wrong tag sizes" : "scale of the measured distances", 100 * v[6],
          corners ? "camera" : "robot");
    case Suspect::CameraLatency:
      return fmt::format(
          "the innovations show a wrong camera latency: by about {:+.0f} ms. Run `waymark calibrate robot` "
          "and "
          "pass the result with `calibration`, or set `camera_latency_s`",
          1000 * v[7]);
  }
  return {};
}

}  // namespace waymark
