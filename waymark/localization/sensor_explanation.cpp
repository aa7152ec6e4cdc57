#include "waymark/localization/sensor_explanation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "waymark/localization/motion_comparison.hpp"

namespace waymark {
namespace {

using internal::ComparedInterval;
using internal::ComparedMotions;
using internal::fit_sensor_model;
using internal::kSensorNumbers;
using internal::SensorModel;
using internal::SensorModelFit;
using internal::SensorNumber;
using internal::SensorNumbers;

constexpr double kDegree = std::numbers::pi / 180;

/// A fault, how many recordings have it, and the number that it leaves free.
struct FaultRow {
  SensorFault fault;
  std::string_view name;
  SensorKind source;
  double prior;                        ///< share of recordings
  std::optional<SensorNumber> free{};  ///< number that the fault changes
  double sigma = 0;                    ///< standard deviation of that number with the fault
  double min_reported = 0;             ///< smaller values have no effect that matters
};

/// The prior probabilities. The most frequent faults in public reports about robots are gyros in deg/s and
/// with z down. Latencies and scales are less frequent. A factor of 57.3 is far more likely for a gyro than
/// for wheels.
constexpr std::array kFaults{
    FaultRow{SensorFault::GyroUnit, "gyro_unit", SensorKind::Gyro, 0.02},
    FaultRow{SensorFault::GyroAxis, "gyro_axis", SensorKind::Gyro, 0.02},
    FaultRow{SensorFault::GyroScale, "gyro_scale", SensorKind::Gyro, 0.02, SensorNumber::GyroScale, 0.2,
             0.05},
    FaultRow{SensorFault::GyroTime, "gyro_time", SensorKind::Gyro, 0.01, SensorNumber::GyroTime, 0.3, 0.03},
    FaultRow{SensorFault::GyroUnrelated, "gyro_unrelated", SensorKind::Gyro, 0.005},
    FaultRow{SensorFault::OdometryYawSign, "odometry_yaw_sign", SensorKind::Odometry, 0.0005},
    FaultRow{SensorFault::OdometryYawScale, "odometry_yaw_scale", SensorKind::Odometry, 0.1,
             SensorNumber::YawScale, 0.3, 0.05},
    FaultRow{SensorFault::OdometryDistanceUnit, "odometry_distance_unit", SensorKind::Odometry, 0.003},
    FaultRow{SensorFault::OdometryReversed, "odometry_reversed", SensorKind::Odometry, 0.002},
    FaultRow{SensorFault::OdometryDistanceScale, "odometry_distance_scale", SensorKind::Odometry, 0.1,
             SensorNumber::DistanceScale, 0.15, 0.04},
    FaultRow{SensorFault::OdometryTime, "odometry_time", SensorKind::Odometry, 0.03,
             SensorNumber::OdometryTime, 0.3, 0.03},
    FaultRow{SensorFault::OdometryUnrelated, "odometry_unrelated", SensorKind::Odometry, 0.001},
    FaultRow{SensorFault::ObservationTime, "observation_time", SensorKind::Observations, 0.05,
             SensorNumber::ObservationTime, 0.3, 0.03},
    FaultRow{SensorFault::ObservedDistanceUnit, "observed_distance_unit", SensorKind::Observations, 0.003},
    FaultRow{SensorFault::ObservedScale, "observed_scale", SensorKind::Observations, 0.05,
             SensorNumber::ObservedScale, 0.05, 0.02},
    FaultRow{SensorFault::MountingReversed, "mounting_reversed", SensorKind::Observations, 0.002},
    FaultRow{SensorFault::ObservedUnrelated, "observed_unrelated", SensorKind::Observations, 0.001},
};

const FaultRow& row_of(SensorFault fault) { return *std::ranges::find(kFaults, fault, &FaultRow::fault); }

/// Standard deviations of the numbers of sensors without a fault, in the order of SensorNumber.
SensorNumbers sigma_without_fault() {
  return (SensorNumbers() << 0.02, 0.02, 0.01, 0.01, 0.01, 0.005, 0.005, 0.01, 0.01).finished();
}

/// A model with one fault, the first values of its numbers, and the logarithm of its prior probability.
struct FaultHypothesis {
  SensorFault fault = SensorFault::GyroUnit;
  double log_prior = 0;
  SensorModel model{};
  SensorNumbers start = SensorNumbers::Zero();
  double factor = 1;  ///< measured over true value, as assumed
};

FaultHypothesis hypothesis_of(SensorFault fault) {
  const FaultRow& row = row_of(fault);
  FaultHypothesis hypothesis{.fault = fault, .log_prior = std::log(row.prior)};
  hypothesis.model.sigma = sigma_without_fault();
  if (row.free) hypothesis.model.sigma[static_cast<Eigen::Index>(*row.free)] = row.sigma;
  return hypothesis;
}

/// All combinations of a unit and an axis but the correct one. Another axis than z happens less often than a
/// wrong sign.
void add_gyro_readings(std::vector<FaultHypothesis>& all) {
  struct Unit {
    double factor, prior;
  };
  constexpr std::array kUnits{Unit{1, 1}, Unit{kDegree, 0.02}, Unit{1 / kDegree, 0.003}};
  constexpr double kAcrossPrior = 0.25;  // relative to the opposite sign
  constexpr double kScaleSigma = 0.02;
  for (const Unit& unit : kUnits) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {1.0, -1.0}) {
        const bool up = axis == 2 && sign > 0;
        if (up && unit.factor == 1) continue;
        FaultHypothesis hypothesis = hypothesis_of(up ? SensorFault::GyroUnit : SensorFault::GyroAxis);
        if (up) hypothesis.log_prior = 0;
        hypothesis.log_prior += std::log(unit.prior);
        if (axis != 2) hypothesis.log_prior += std::log(kAcrossPrior);
        hypothesis.model.gyro_up = sign * Eigen::Vector3d::Unit(axis);
        hypothesis.model.gyro_factor = unit.factor;
        hypothesis.model.sigma[static_cast<Eigen::Index>(SensorNumber::GyroScale)] = kScaleSigma;
        hypothesis.factor = 1 / unit.factor;
        all.push_back(hypothesis);
      }
    }
  }
}

/// Distances in centimetres or millimetres.
void add_distance_units(SensorFault fault, double SensorModel::*factor, std::initializer_list<double> ratios,
                        std::vector<FaultHypothesis>& all) {
  for (const double ratio : ratios) {
    FaultHypothesis hypothesis = hypothesis_of(fault);
    hypothesis.model.*factor = 1 / ratio;
    hypothesis.factor = ratio;
    all.push_back(hypothesis);
  }
}

/// One hypothesis for each of several offsets, because the likelihood has several maxima.
void add_offsets(SensorFault fault, double max_offset_s, std::vector<FaultHypothesis>& all) {
  constexpr int kSteps = 10;  // to each side
  const FaultRow& row = row_of(fault);
  const auto number = static_cast<Eigen::Index>(*row.free);
  for (int i = -kSteps; i <= kSteps; ++i) {
    all.push_back(hypothesis_of(fault));
    all.back().model.sigma[number] = std::max(row.sigma, max_offset_s / 2);
    all.back().start[number] = max_offset_s * i / kSteps;
  }
}

void add_gyro_faults(double max_offset_s, std::vector<FaultHypothesis>& all) {
  add_gyro_readings(all);
  all.push_back(hypothesis_of(SensorFault::GyroScale));
  add_offsets(SensorFault::GyroTime, max_offset_s, all);
  all.push_back(hypothesis_of(SensorFault::GyroUnrelated));
  all.back().model.gyro_unrelated = true;
}

void add_odometry_faults(double max_offset_s, std::vector<FaultHypothesis>& all) {
  all.push_back(hypothesis_of(SensorFault::OdometryYawSign));
  all.back().model.yaw_factor = -1;
  all.push_back(hypothesis_of(SensorFault::OdometryYawScale));
  add_distance_units(SensorFault::OdometryDistanceUnit, &SensorModel::distance_factor, {100, 1000}, all);
  all.push_back(hypothesis_of(SensorFault::OdometryReversed));
  all.back().model.distance_factor = -1;
  all.push_back(hypothesis_of(SensorFault::OdometryDistanceScale));
  add_offsets(SensorFault::OdometryTime, max_offset_s, all);
  all.push_back(hypothesis_of(SensorFault::OdometryUnrelated));
  all.back().model.odometry_unrelated = true;
}

void add_observation_faults(double max_offset_s, std::vector<FaultHypothesis>& all) {
  add_offsets(SensorFault::ObservationTime, max_offset_s, all);
  add_distance_units(SensorFault::ObservedDistanceUnit, &SensorModel::observed_factor,
                     {0.001, 0.01, 100, 1000}, all);
  all.push_back(hypothesis_of(SensorFault::ObservedScale));
  all.push_back(hypothesis_of(SensorFault::MountingReversed));
  all.back().model.observed_factor = -1;
  all.push_back(hypothesis_of(SensorFault::ObservedUnrelated));
  all.back().model.observed_unrelated = true;
}

/// The faults of the sources that have data.
std::vector<FaultHypothesis> all_hypotheses(const ComparedMotions& motions, double max_offset_s) {
  std::vector<FaultHypothesis> all;
  if (!motions.gyro.empty()) add_gyro_faults(max_offset_s, all);
  if (!motions.odometry.empty()) add_odometry_faults(max_offset_s, all);
  if (motions.intervals.front().observed) add_observation_faults(max_offset_s, all);
  return all;
}

// Intervals.

/// Whether a source has data for an interval, whatever its time offset is.
bool is_covered(const IntegralTrack& track, const ComparedInterval& interval, double margin_s) {
  return track.empty() || track.change(interval.from_s - margin_s, interval.to_s + margin_s).has_value();
}

/// Appends a motion that begins where another one ends. The errors of the pose in between cancel.
void append(const ComparedInterval& next, ComparedInterval& interval) {
  interval.to_s = next.to_s;
  interval.observed->to = next.observed->to;
  interval.observed->twist += next.observed->twist;
  interval.observed->sigma_m = std::max(interval.observed->sigma_m, next.observed->sigma_m);
  interval.observed->sigma_rad = std::max(interval.observed->sigma_rad, next.observed->sigma_rad);
}

/// Observed motions that do not overlap. Those that follow each other are joined, because poses from single
/// images have errors that matter less over a longer time.
std::vector<ComparedInterval> observed_intervals(const std::vector<ObservedMotion>& observed,
                                                 SensorTime epoch) {
  constexpr double kMinDuration_s = 0.3;
  constexpr double kMaxDuration_s = 3;
  constexpr double kJoined_s = 2.6;
  std::vector<ComparedInterval> intervals;
  for (const ObservedMotion& motion : observed) {
    const ComparedInterval next{to_seconds(motion.from - epoch), to_seconds(motion.to - epoch), motion};
    const double duration_s = next.to_s - next.from_s;
    const bool overlaps = !intervals.empty() && next.from_s < intervals.back().to_s;
    const bool sound = motion.twist.allFinite() && motion.sigma_m >= 0 && motion.sigma_rad >= 0;
    if (!sound || overlaps || duration_s < kMinDuration_s || duration_s > kMaxDuration_s) continue;
    const bool joins = !intervals.empty() && motion.from == intervals.back().observed->to &&
                       next.to_s - intervals.back().from_s <= kJoined_s;
    if (joins)
      append(next, intervals.back());
    else
      intervals.push_back(next);
  }
  return intervals;
}

/// Intervals of two seconds for which both odometry and gyro have data.
std::vector<ComparedInterval> regular_intervals(const ComparedMotions& motions) {
  constexpr double kDuration_s = 2;
  std::vector<ComparedInterval> intervals;
  if (motions.odometry.empty() || motions.gyro.empty()) return intervals;
  const double end_s = std::min(motions.odometry.last_s(), motions.gyro.last_s());
  double from_s = std::max(motions.odometry.first_s(), motions.gyro.first_s());
  for (; from_s + kDuration_s <= end_s; from_s += kDuration_s)
    intervals.push_back({from_s, from_s + kDuration_s, {}});
  return intervals;
}

/// At most kMaxIntervals, evenly spread.
void thin_out(std::vector<ComparedInterval>& intervals) {
  constexpr std::size_t kMaxIntervals = 300;
  if (intervals.size() <= kMaxIntervals) return;
  for (std::size_t i = 0; i < kMaxIntervals; ++i)
    intervals[i] = intervals[i * intervals.size() / kMaxIntervals];
  intervals.resize(kMaxIntervals);
}

ComparedMotions compared_motions(const MotionSources& sources, double max_offset_s) {
  constexpr double kMargin_s = 0.1;  // for rates at the ends
  SensorTime epoch{};
  if (!sources.odometry.empty()) epoch = sources.odometry.front().stamp;
  if (sources.odometry.empty() && !sources.imu.empty()) epoch = sources.imu.front().stamp;
  ComparedMotions motions{.odometry = IntegralTrack::of_odometry(sources.odometry, epoch),
                          .gyro = IntegralTrack::of_gyro(sources.imu, epoch)};
  motions.intervals =
      sources.observed.empty() ? regular_intervals(motions) : observed_intervals(sources.observed, epoch);
  std::erase_if(motions.intervals, [&](const ComparedInterval& interval) {
    return !is_covered(motions.odometry, interval, max_offset_s + kMargin_s) ||
           !is_covered(motions.gyro, interval, max_offset_s + kMargin_s);
  });
  thin_out(motions.intervals);
  return motions;
}

// Ranking.

SensorModel model_without_fault() {
  SensorModel model;
  model.sigma = sigma_without_fault();
  return model;
}

/// Whether the sources agree so well that no fault needs to be searched for.
bool agree(const SensorModelFit& fit) {
  constexpr double kMaxNoiseRatio = 1.7;
  constexpr double kMaxSigmas = 1.5;
  return fit.noise_ratio < kMaxNoiseRatio &&
         fit.value.cwiseQuotient(sigma_without_fault()).cwiseAbs().maxCoeff() < kMaxSigmas;
}

bool is_time_number(SensorNumber number) {
  return number == SensorNumber::GyroTime || number == SensorNumber::OdometryTime ||
         number == SensorNumber::ObservationTime;
}

/// The fault with its number, from the fit.
SensorExplanation explanation_of(const FaultHypothesis& hypothesis, const SensorModelFit& fit,
                                 double log_odds) {
  const std::optional<SensorNumber> free = row_of(hypothesis.fault).free;
  SensorExplanation explanation{.fault = hypothesis.fault,
                                .value = hypothesis.factor,
                                .log_odds = log_odds,
                                .gyro_up = hypothesis.model.gyro_up};
  const auto number = [&](SensorNumber which) { return static_cast<Eigen::Index>(which); };
  const bool is_reading =
      hypothesis.fault == SensorFault::GyroUnit || hypothesis.fault == SensorFault::GyroAxis;
  if (is_reading) {
    const Eigen::Index scale = number(SensorNumber::GyroScale);
    explanation.value = hypothesis.factor / (1 + fit.value[scale]);
    explanation.sigma = explanation.value * std::sqrt(fit.covariance(scale, scale));
  }
  if (!free) return explanation;
  explanation.value = fit.value[number(*free)] + (is_time_number(*free) ? 0 : 1);
  explanation.sigma = std::sqrt(fit.covariance(number(*free), number(*free)));
  return explanation;
}

/// Whether an explanation is significant, and large enough to matter.
bool is_reported(const SensorExplanation& explanation) {
  constexpr double kMinLogOdds = 3;
  constexpr double kMinSigmas = 4;
  if (explanation.log_odds < kMinLogOdds) return false;
  const FaultRow& row = row_of(explanation.fault);
  if (!row.free) return true;
  const double off = std::abs(explanation.value - (is_time_number(*row.free) ? 0 : 1));
  return off >= row.min_reported && off >= kMinSigmas * explanation.sigma;
}

/// Fits each hypothesis; of several with the same fault and axis, only the best counts.
std::vector<SensorExplanation> all_explanations(const ComparedMotions& motions, const SensorModelFit& without,
                                                double max_offset_s) {
  constexpr int kRounds = 40;
  constexpr int kFirstRounds = 6;
  std::vector<SensorExplanation> all;
  const std::vector<FaultHypothesis> hypotheses = all_hypotheses(motions, max_offset_s);
  for (std::size_t i = 0; i < hypotheses.size();) {
    const FaultHypothesis* best = &hypotheses[i];
    double most = -1e300;
    std::size_t end = i;
    const bool has_starts = row_of(best->fault).free && hypotheses[i].start != SensorNumbers::Zero();
    for (; end < hypotheses.size() && hypotheses[end].fault == hypotheses[i].fault && has_starts; ++end) {
      const SensorModelFit fit =
          fit_sensor_model(motions, hypotheses[end].model, hypotheses[end].start, max_offset_s, kFirstRounds);
      if (fit.log_evidence <= most) continue;
      most = fit.log_evidence;
      best = &hypotheses[end];
    }
    const SensorModelFit fit = fit_sensor_model(motions, best->model, best->start, max_offset_s, kRounds);
    all.push_back(explanation_of(*best, fit, fit.log_evidence + best->log_prior - without.log_evidence));
    i = std::max(end, i + 1);
  }
  std::ranges::stable_sort(all, std::ranges::greater{}, &SensorExplanation::log_odds);
  return all;
}

}  // namespace

SensorKind source_of(SensorFault fault) { return row_of(fault).source; }

std::string_view to_string(SensorFault fault) { return row_of(fault).name; }

SensorExplanations explain_sensors(const MotionSources& sources, const SensorExplanationOptions& options) {
  constexpr std::size_t kMinIntervals = 8;
  constexpr int kRounds = 40;
  constexpr double kDecidedLogOdds = 3;
  const ComparedMotions motions = compared_motions(sources, options.max_offset_s);
  SensorExplanations result{.intervals = motions.intervals.size()};
  const int count = (motions.odometry.empty() ? 0 : 1) + (motions.gyro.empty() ? 0 : 1) +
                    (sources.observed.empty() ? 0 : 1);
  if (result.intervals < kMinIntervals || count < 2) return result;
  const SensorModelFit without =
      fit_sensor_model(motions, model_without_fault(), SensorNumbers::Zero(), options.max_offset_s, kRounds);
  if (agree(without)) return result;
  const std::vector<SensorExplanation> all = all_explanations(motions, without, options.max_offset_s);
  if (all.empty() || !is_reported(all.front())) return result;
  std::ranges::copy_if(all, std::back_inserter(result.likely), is_reported);
  const SensorKind source = source_of(all.front().fault);
  const auto rival = std::ranges::find_if(
      all, [&](const SensorExplanation& other) { return source_of(other.fault) != source; });
  if (rival != all.end() && rival->log_odds > 0) result.rival = *rival;
  result.decided = !result.rival || all.front().log_odds - result.rival->log_odds >= kDecidedLogOdds;
  return result;
}

}  // namespace waymark
