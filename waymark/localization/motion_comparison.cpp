#include "waymark/localization/motion_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>

#include "waymark/base/order_statistics.hpp"

namespace waymark::internal {
namespace {

/// Residuals of neighbouring intervals share the errors of a fix and of a slip, so they count less.
constexpr double kIndependentShare = 0.8;
constexpr double kFreedom = 4;        ///< degrees of freedom of Student's t distribution
constexpr double kNoisePrior = 3;     ///< number of intervals that the usual noise counts for
constexpr double kFirstNoise2 = 100;  ///< large at first, so that the weights do not exclude a wrong start
constexpr double kTypicalSpeed_m_s = 0.4;
constexpr double kSpeedLogSigma = 1.2;  ///< of the logarithm of the speed of a robot

constexpr Eigen::Index at(SensorNumber number) { return static_cast<Eigen::Index>(number); }

/// The noise of a source in a channel has its own level.
enum class Noise : std::uint8_t { GyroTurn, OdometryTurn, ObservedTurn, OdometryDistance, ObservedDistance };
constexpr std::size_t kNoises = 5;

/// A measurement of the turn or the distance in one interval.
struct MeasuredMotion {
  Noise noise = Noise::GyroTurn;
  double value = 0;                         ///< corrected by the model and its numbers
  double variance = 0;                      ///< with the usual noise
  SensorNumbers J = SensorNumbers::Zero();  ///< d value / d numbers
};

/// The measurements of one quantity in one interval.
struct MeasuredTogether {
  std::array<MeasuredMotion, 3> all{};
  std::size_t count = 0;

  void add(const MeasuredMotion& measured) { all[count++] = measured; }
};

/// Sums over all intervals for one step.
struct StepSums {
  SensorNumbersMatrix A = SensorNumbersMatrix::Zero();
  SensorNumbers g = SensorNumbers::Zero();
  std::array<double, kNoises> squares{};
  std::array<double, kNoises> counts{};
  std::array<double, 2> true_squares{};  ///< of turns and of distances
  std::array<double, 2> true_counts{};
  double log_likelihood = 0;
  std::vector<double> speeds_m_s{};
};

/// Log-likelihood of values that follow a normal distribution with mean zero and the variance that fits best.
double log_likelihood_of_spread(const std::vector<double>& values, double floor) {
  if (values.empty()) return 0;
  double squares = 0;
  for (const double value : values) squares += value * value;
  const auto n = static_cast<double>(values.size());
  const double variance = squares / n + floor * floor;
  return -n / 2 * (std::log(2 * std::numbers::pi * variance) + squares / n / variance);
}

class SensorModelSearch {
 public:
  SensorModelSearch(const ComparedMotions& motions, const SensorModel& model, const SensorNumbers& start,
                    double max_offset_s)
      : motions_(motions), model_(model), max_offset_s_(max_offset_s), x_(start) {
    noise2_.fill(kFirstNoise2);
    start_spread();
  }

  void run(int rounds) {
    constexpr double kConverged = 1e-3;
    double before = -1e300;
    for (int i = 0; i < rounds; ++i) {
      sums_ = sum();
      const double now = sums_.log_likelihood + log_prior_of_noise();
      const bool converged = i > 8 && std::abs(now - before) < kConverged;
      before = now;
      step();
      if (converged) break;
    }
    sums_ = sum();
  }

  [[nodiscard]] SensorModelFit result() const {
    SensorModelFit fit{.value = x_};
    const Eigen::LLT<SensorNumbersMatrix> llt(sums_.A);
    fit.covariance = llt.solve(SensorNumbersMatrix::Identity());
    double log_det = 0;
    for (Eigen::Index i = 0; i < kSensorNumbers; ++i)
      log_det += 2 * std::log(llt.matrixLLT()(i, i)) + 2 * std::log(model_.sigma[i]);
    const SensorNumbers white = x_.cwiseQuotient(model_.sigma);
    fit.log_evidence =
        kIndependentShare * (sums_.log_likelihood + log_prior_of_noise() + log_likelihood_of_others()) +
        log_prior_of_speed() - white.squaredNorm() / 2 - log_det / 2;
    fit.noise_ratio = std::sqrt(*std::ranges::max_element(noise2_));
    return fit;
  }

 private:
  [[nodiscard]] double number(SensorNumber which) const { return x_[at(which)]; }
  [[nodiscard]] double scale(SensorNumber which) const { return 1 + number(which); }

  /// Time by which the stamps of a source exceed those of the observations.
  [[nodiscard]] double shift_s(SensorNumber time) const {
    return std::clamp(number(time) - number(SensorNumber::ObservationTime), -max_offset_s_, max_offset_s_);
  }

  [[nodiscard]] std::optional<MeasuredMotion> gyro_turn(const ComparedInterval& interval) const {
    constexpr double kNoise_rad_sqrt_s = 0.003;
    constexpr double kFloor_rad = 0.0005;
    if (motions_.gyro.empty() || model_.gyro_unrelated) return std::nullopt;
    const double shift = shift_s(SensorNumber::GyroTime);
    const double duration_s = interval.to_s - interval.from_s;
    const auto turned = motions_.gyro.change(interval.from_s + shift, interval.to_s + shift);
    if (!turned) return std::nullopt;
    const double turn = model_.gyro_factor * model_.gyro_up.dot(*turned);
    MeasuredMotion measured{
        .noise = Noise::GyroTurn,
        .value = scale(SensorNumber::GyroScale) * turn - duration_s * number(SensorNumber::GyroBias),
        .variance = kNoise_rad_sqrt_s * kNoise_rad_sqrt_s * duration_s + kFloor_rad * kFloor_rad};
    measured.J[at(SensorNumber::GyroBias)] = -duration_s;
    measured.J[at(SensorNumber::GyroScale)] = turn;
    const double by_time = scale(SensorNumber::GyroScale) * model_.gyro_factor *
                           model_.gyro_up.dot(rate_change(motions_.gyro, interval, shift));
    add_time(SensorNumber::GyroTime, by_time, measured);
    return measured;
  }

  /// Change of the rates of a source during an interval.
  [[nodiscard]] static Eigen::Vector3d rate_change(const IntegralTrack& track,
                                                   const ComparedInterval& interval, double shift) {
    const auto before = track.rate(interval.from_s + shift);
    const auto after = track.rate(interval.to_s + shift);
    if (!before || !after) return Eigen::Vector3d::Zero();
    return *after - *before;
  }

  static void add_time(SensorNumber time, double by_time, MeasuredMotion& measured) {
    measured.J[at(time)] = by_time;
    measured.J[at(SensorNumber::ObservationTime)] = -by_time;
  }

  /// Adds the turn and the distance according to the odometry.
  void add_odometry(const ComparedInterval& interval, MeasuredTogether& turns,
                    MeasuredTogether& distances) const {
    constexpr double kTurnNoise_sqrt = 0.015;  // rad per square root of a radian, and of a metre
    constexpr double kDistanceNoise_sqrt_m = 0.01;
    constexpr double kFloor = 0.001;  // [m], [rad]
    if (motions_.odometry.empty() || model_.odometry_unrelated) return;
    const double shift = shift_s(SensorNumber::OdometryTime);
    const auto moved = motions_.odometry.change(interval.from_s + shift, interval.to_s + shift);
    if (!moved) return;
    const Eigen::Vector3d rates = rate_change(motions_.odometry, interval, shift);
    const double path_m = std::abs(model_.distance_factor) * moved->z();
    const double turn = model_.yaw_factor * moved->y();
    MeasuredMotion by_turn{
        .noise = Noise::OdometryTurn,
        .value = scale(SensorNumber::YawScale) * turn,
        .variance = kTurnNoise_sqrt * kTurnNoise_sqrt * (std::abs(turn) + path_m) + kFloor * kFloor};
    by_turn.J[at(SensorNumber::YawScale)] = turn;
    add_time(SensorNumber::OdometryTime, scale(SensorNumber::YawScale) * model_.yaw_factor * rates.y(),
             by_turn);
    turns.add(by_turn);
    const double distance = model_.distance_factor * moved->x();
    MeasuredMotion by_distance{
        .noise = Noise::OdometryDistance,
        .value = scale(SensorNumber::DistanceScale) * distance,
        .variance = kDistanceNoise_sqrt_m * kDistanceNoise_sqrt_m * path_m + kFloor * kFloor};
    by_distance.J[at(SensorNumber::DistanceScale)] = distance;
    add_time(SensorNumber::OdometryTime,
             scale(SensorNumber::DistanceScale) * model_.distance_factor * rates.x(), by_distance);
    distances.add(by_distance);
  }

  void add_observed(const ComparedInterval& interval, MeasuredTogether& turns,
                    MeasuredTogether& distances) const {
    constexpr double kFloor = 0.001;  // [m], [rad]
    if (!interval.observed || model_.observed_unrelated) return;
    const ObservedMotion& seen = *interval.observed;
    turns.add({.noise = Noise::ObservedTurn,
               .value = seen.twist.z(),
               .variance = seen.sigma_rad * seen.sigma_rad + kFloor * kFloor});
    if (!std::isfinite(seen.sigma_m)) return;
    const double distance = model_.observed_factor * seen.twist.x();
    MeasuredMotion by_distance{
        .noise = Noise::ObservedDistance,
        .value =
            scale(SensorNumber::ObservedScale) * distance + number(SensorNumber::MountingY) * seen.twist.z(),
        .variance =
            model_.observed_factor * model_.observed_factor * seen.sigma_m * seen.sigma_m + kFloor * kFloor};
    by_distance.J[at(SensorNumber::ObservedScale)] = distance;
    by_distance.J[at(SensorNumber::MountingY)] = seen.twist.z();
    distances.add(by_distance);
  }

  [[nodiscard]] std::pair<MeasuredTogether, MeasuredTogether> measure(
      const ComparedInterval& interval) const {
    MeasuredTogether turns;
    MeasuredTogether distances;
    if (const auto turn = gyro_turn(interval)) turns.add(*turn);
    add_odometry(interval, turns, distances);
    add_observed(interval, turns, distances);
    return {turns, distances};
  }

  /// Logarithm of the derivative of a corrected by a measured value, because the likelihood is that of what
  /// was measured.
  [[nodiscard]] double log_slope(Noise noise) const {
    switch (noise) {
      case Noise::GyroTurn:
        return std::log(std::abs(model_.gyro_factor * scale(SensorNumber::GyroScale)));
      case Noise::OdometryTurn:
        return std::log(std::abs(model_.yaw_factor * scale(SensorNumber::YawScale)));
      case Noise::OdometryDistance:
        return std::log(std::abs(model_.distance_factor * scale(SensorNumber::DistanceScale)));
      case Noise::ObservedDistance:
        return std::log(std::abs(model_.observed_factor * scale(SensorNumber::ObservedScale)));
      case Noise::ObservedTurn:
        break;
    }
    return 0;
  }

  /// Starts with the mean square of the measured turns and distances as the variance of the true ones.
  void start_spread() {
    std::array<double, 2> squares{};
    std::array<double, 2> counts{};
    for (const ComparedInterval& interval : motions_.intervals) {
      const auto both = measure(interval);
      for (const auto& [channel, together] : {std::pair(0UL, &both.first), std::pair(1UL, &both.second)}) {
        for (std::size_t i = 0; i < together->count; ++i) {
          squares[channel] += together->all[i].value * together->all[i].value;
          counts[channel] += 1;
        }
      }
    }
    for (std::size_t channel = 0; channel < 2; ++channel)
      true_variance_[channel] = (squares[channel] + kFloor2) / (counts[channel] + 1);
  }

  /// Adds the measurements of one quantity in one interval. Returns the estimated true value.
  double add(const MeasuredTogether& together, std::size_t channel, StepSums& sums) const {
    if (together.count == 0) return 0;
    std::array<double, 3> p{};
    double P = 1 / true_variance_[channel];
    double mean = 0;
    SensorNumbers pJ = SensorNumbers::Zero();
    double log_p = -std::log(true_variance_[channel]);
    for (std::size_t i = 0; i < together.count; ++i) {
      const MeasuredMotion& m = together.all[i];
      p[i] = 1 / (noise2_[static_cast<std::size_t>(m.noise)] * m.variance);
      P += p[i];
      mean += p[i] * m.value;
      pJ += p[i] * m.J;
      log_p += std::log(p[i]) + 2 * log_slope(m.noise);
    }
    mean /= P;
    double q = 0;
    for (std::size_t i = 0; i < together.count; ++i) {
      const double off = together.all[i].value - mean;
      q += p[i] * off * off;
    }
    const auto n = static_cast<double>(together.count);
    const double d = n - 1;
    const double weight = (kFreedom + d) / (kFreedom + q);
    for (std::size_t i = 0; i < together.count; ++i) {
      const MeasuredMotion& m = together.all[i];
      const double off = m.value - mean;
      const auto level = static_cast<std::size_t>(m.noise);
      sums.squares[level] += (weight * off * off + 1 / P) / m.variance;
      sums.counts[level] += 1;
      sums.g -= kIndependentShare * weight * p[i] * off * m.J;
      sums.A.noalias() += kIndependentShare * weight * p[i] * m.J * m.J.transpose();
    }
    sums.A.noalias() -= kIndependentShare * weight / P * pJ * pJ.transpose();
    sums.true_squares[channel] += mean * mean + 1 / P;
    sums.true_counts[channel] += 1;
    sums.log_likelihood += -n / 2 * std::log(2 * std::numbers::pi) + (log_p - std::log(P)) / 2 -
                           mean * mean / true_variance_[channel] / 2 + std::lgamma((kFreedom + d) / 2) -
                           std::lgamma(kFreedom / 2) - d / 2 * std::log(kFreedom / 2) -
                           (kFreedom + d) / 2 * std::log1p(q / kFreedom);
    return mean;
  }

  [[nodiscard]] StepSums sum() const {
    StepSums sums;
    sums.A.diagonal() = model_.sigma.cwiseAbs2().cwiseInverse();
    sums.g = -sums.A.diagonal().cwiseProduct(x_);
    for (const ComparedInterval& interval : motions_.intervals) {
      const auto [turns, distances] = measure(interval);
      add(turns, 0, sums);
      const double distance_m = add(distances, 1, sums);
      constexpr double kMinSpeed_m_s = 1e-3;
      const double speed_m_s = std::abs(distance_m) / (interval.to_s - interval.from_s);
      if (distances.count > 0 && speed_m_s > kMinSpeed_m_s) sums.speeds_m_s.push_back(speed_m_s);
    }
    const auto add_slope = [&](SensorNumber number, Noise noise) {
      const double n = kIndependentShare * sums.counts[static_cast<std::size_t>(noise)];
      sums.g[at(number)] += n / scale(number);
      sums.A(at(number), at(number)) += n / (scale(number) * scale(number));
    };
    add_slope(SensorNumber::GyroScale, Noise::GyroTurn);
    add_slope(SensorNumber::YawScale, Noise::OdometryTurn);
    add_slope(SensorNumber::DistanceScale, Noise::OdometryDistance);
    add_slope(SensorNumber::ObservedScale, Noise::ObservedDistance);
    return sums;
  }

  void step() {
    constexpr double kMinScale = 0.05;
    constexpr double kMaxTimeStep_s = 0.1;
    SensorNumbers change = sums_.A.ldlt().solve(sums_.g);
    if (!change.allFinite()) return;
    for (const SensorNumber time :
         {SensorNumber::GyroTime, SensorNumber::OdometryTime, SensorNumber::ObservationTime}) {
      change[at(time)] = std::clamp(change[at(time)], -kMaxTimeStep_s, kMaxTimeStep_s);
      x_[at(time)] = std::clamp(number(time) + change[at(time)], -max_offset_s_, max_offset_s_);
      change[at(time)] = 0;
    }
    x_ += change;
    for (const SensorNumber factor : {SensorNumber::GyroScale, SensorNumber::YawScale,
                                      SensorNumber::DistanceScale, SensorNumber::ObservedScale})
      x_[at(factor)] = std::max(number(factor), kMinScale - 1);
    for (std::size_t i = 0; i < kNoises; ++i)
      noise2_[i] = (kNoisePrior + sums_.squares[i]) / (kNoisePrior + sums_.counts[i]);
    for (std::size_t i = 0; i < 2; ++i)
      true_variance_[i] = (kFloor2 + sums_.true_squares[i]) / (1 + sums_.true_counts[i]);
  }

  /// Inverse gamma distributions of the variances of the noise, relative to the usual ones.
  [[nodiscard]] double log_prior_of_noise() const {
    double sum = 0;
    for (const double noise2 : noise2_) sum -= kNoisePrior / 2 * (std::log(noise2) + 1 / noise2);
    return sum;
  }

  /// Unit errors are recognised by impossible speeds.
  [[nodiscard]] double log_prior_of_speed() const {
    if (sums_.speeds_m_s.empty()) return 0;
    const double off = std::log(median(sums_.speeds_m_s) / kTypicalSpeed_m_s) / kSpeedLogSigma;
    return -off * off / 2;
  }

  /// Log-likelihood of the measured values that the model does not relate to the motion: rotations about the
  /// other axes of the gyro, and unrelated sources.
  [[nodiscard]] double log_likelihood_of_others() const {
    constexpr double kFloor = 1e-4;  // [rad], [m]
    std::array<std::vector<double>, 7> others;
    for (const ComparedInterval& interval : motions_.intervals) {
      if (!motions_.gyro.empty()) {
        const auto turned = motions_.gyro.change(interval.from_s, interval.to_s);
        for (Eigen::Index axis = 0; turned && axis < 3; ++axis) {
          if (!model_.gyro_unrelated && model_.gyro_up[axis] != 0) continue;
          others[static_cast<std::size_t>(axis)].push_back((*turned)[axis]);
        }
      }
      if (!motions_.odometry.empty() && model_.odometry_unrelated) {
        const auto moved = motions_.odometry.change(interval.from_s, interval.to_s);
        for (Eigen::Index i = 0; moved && i < 2; ++i)
          others[static_cast<std::size_t>(3 + i)].push_back((*moved)[i]);
      }
      if (interval.observed && model_.observed_unrelated) {
        if (std::isfinite(interval.observed->sigma_m)) others[5].push_back(interval.observed->twist.x());
        others[6].push_back(interval.observed->twist.z());
      }
    }
    double sum = 0;
    for (const std::vector<double>& values : others) sum += log_likelihood_of_spread(values, kFloor);
    return sum;
  }

  static constexpr double kFloor2 = 1e-6;  ///< [m^2], [rad^2] of the true motion

  const ComparedMotions& motions_;
  const SensorModel& model_;
  double max_offset_s_;
  SensorNumbers x_;
  std::array<double, kNoises> noise2_{};       ///< relative to the usual variances
  std::array<double, 2> true_variance_{1, 1};  ///< of turns and of distances
  StepSums sums_{};
};

}  // namespace

SensorModelFit fit_sensor_model(const ComparedMotions& motions, const SensorModel& model,
                                const SensorNumbers& start, double max_offset_s, int rounds) {
  SensorModelSearch search(motions, model, start, max_offset_s);
  search.run(rounds);
  return search.result();
}

}  // namespace waymark::internal
