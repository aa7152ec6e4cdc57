#include "waymark/localization/innovation_calibration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <variant>

#include "waymark/base/order_statistics.hpp"
#include "waymark/localization/innovation_cost.hpp"
#include "waymark/localization/kept_numbers.hpp"

namespace waymark {
namespace {

using internal::InnovationRuns;
using internal::RunCost;

constexpr std::size_t at(Calibrated what) { return static_cast<std::size_t>(what); }

/// Which of the numbers each of kSystematic is; nothing: not sought.
using Places = std::array<std::optional<std::size_t>, kSystematic>;

/// What is asked for and can be told at all: with a gyro the wheels do not turn the robot, without one there
/// is none; only corners tell of a camera that is not in the plane, and of its focal length.
Places sought(std::span<const Sample> samples, const InnovationFitOptions& fit) {
  const auto any = [&](auto is) { return std::ranges::any_of(samples, is); };
  const bool gyro = any([](const Sample& s) { return std::holds_alternative<ImuSample>(s); });
  const bool corners = any([](const Sample& s) { return std::holds_alternative<TagFrame>(s); });
  const bool poses = any([](const Sample& s) { return std::holds_alternative<TagPoseFrame>(s); });
  Places places{at(Calibrated::MountingX),
                at(Calibrated::MountingY),
                std::nullopt,
                std::nullopt,
                std::nullopt,
                at(Calibrated::MountingYaw),
                std::nullopt,
                at(Calibrated::CameraLatency),
                at(Calibrated::OdometryScale),
                gyro ? at(Calibrated::GyroGain) : at(Calibrated::YawGain)};
  if (corners) {
    places[2] = at(Calibrated::MountingZ);
    places[3] = at(Calibrated::MountingRoll);
    places[4] = at(Calibrated::MountingPitch);
    places[6] = at(Calibrated::FocalScale);
  } else if (poses) {
    places[6] = at(Calibrated::SightScale);
  }
  for (auto& place : places)
    if (place && !fit.seek[*place]) place.reset();
  return places;
}

SystematicVector prior_of(const Places& places, const CalibratedNumbers& prior) {
  constexpr double kNotSought = 1e-9;
  SystematicVector sigma;
  for (Eigen::Index i = 0; i < kSystematic; ++i) {
    const auto& place = places[static_cast<std::size_t>(i)];
    sigma[i] = place ? prior[*place] : kNotSought;
  }
  return sigma;
}

/// From the numbers of `from` to those of `to`.
SystematicVector difference(const Places& places, const CalibratedNumbers& from,
                            const CalibratedNumbers& to) {
  SystematicVector change = SystematicVector::Zero();
  for (Eigen::Index i = 0; i < kSystematic; ++i)
    if (const auto& place = places[static_cast<std::size_t>(i)]) change[i] = to[*place] - from[*place];
  return change;
}

/// A turn of the mounting is one about the base's origin there, and about the sensor here.
CalibratedNumbers moved(const Places& places, const CalibratedNumbers& numbers, SystematicVector change,
                        const MountedSensor& sensor) {
  const Eigen::Vector3d lever = calibrated_sensor(sensor, numbers).base_T_sensor.translation();
  change.head<3>() += change.segment<3>(3).cross(lever);
  CalibratedNumbers to = numbers;
  for (Eigen::Index i = 0; i < kSystematic; ++i)
    if (const auto& place = places[static_cast<std::size_t>(i)]) to[*place] += change[i];
  return to;
}

/// Further from the start than this is no robot, but a search gone astray.
bool credible(const CalibratedNumbers& numbers, const CalibratedNumbers& start,
              const CalibratedNumbers& prior) {
  constexpr double kMostSigma = 3;
  for (std::size_t i = 0; i < kCalibrated; ++i)
    if (std::abs(numbers[i] - start[i]) > kMostSigma * prior[i]) return false;
  return true;
}

/// The same estimate from wherever it starts: latency is what bends the innovations most.
CalibratedNumbers best_start(InnovationRuns& runs, const Places& places, const CalibratedNumbers& given,
                             double noise_ratio) {
  if (!places[7]) return given;
  CalibratedNumbers best = given;
  double least = runs(given, noise_ratio).fitted_per_row();
  for (const double off_s : {-0.12, -0.06, 0.06, 0.12}) {
    CalibratedNumbers tried = given;
    tried[at(Calibrated::CameraLatency)] += off_s;
    const double cost = runs(tried, noise_ratio).fitted_per_row();
    if (cost >= least) continue;
    least = cost;
    best = tried;
  }
  return best;
}

/// The least of these noises with which the filter finds the robot and goes on seeing tags that it expects.
double wide_enough(InnovationRuns& runs, const Places& places, const CalibratedNumbers& given,
                   const SystematicVector& prior, int landmarks) {
  constexpr std::array kRatios{10.0, 30.0, 100.0};
  for (const double ratio : kRatios) {
    SystematicErrors errors(landmarks);
    runs(given, ratio, &errors);
    if (runs.stopped || errors.fit(prior, difference(places, given, given))) return ratio;
  }
  return kRatios.front();
}

/// Gauss-Newton steps on the innovations, with a noise that shrinks to what it is: outliers and gates bend a
/// narrow net (Blake and Zisserman, "Visual Reconstruction", chapter 3, graduated non-convexity).
CalibratedNumbers search(InnovationRuns& runs, const Places& places, const CalibratedNumbers& given,
                         const MountedSensor& sensor, const InnovationFitOptions& fit, int landmarks) {
  const SystematicVector prior = prior_of(places, fit.prior);
  SystematicErrors errors(landmarks);
  const double widest = wide_enough(runs, places, given, prior, landmarks);
  CalibratedNumbers numbers = best_start(runs, places, given, widest);
  for (const double most : {100.0, 30.0, 10.0, 10.0, 3.0, 3.0}) {
    if (most > widest) continue;
    runs(numbers, most, &errors);
    const auto step = errors.fit(prior, difference(places, given, numbers));
    if (runs.stopped) return numbers;
    if (!step) continue;  // so uncertain that it never found the robot
    const CalibratedNumbers next = moved(places, numbers, step->value, sensor);
    if (credible(next, given, fit.prior)) numbers = next;
  }
  double here = runs(numbers, 1, &errors).fitted_per_row();
  for (int iteration = 0; iteration < fit.iterations && !runs.stopped; ++iteration) {
    const auto step = errors.fit(prior, difference(places, given, numbers));
    if (!step) break;
    bool better = false;
    for (double share = 1; share > 0.2 && !better; share /= 2) {
      const CalibratedNumbers tried = moved(places, numbers, share * step->value, sensor);
      SystematicErrors there_errors(landmarks);
      const double there = runs(tried, 1, &there_errors).fitted_per_row();
      if (there >= here || !credible(tried, given, fit.prior)) continue;
      better = true;
      here = there;
      numbers = tried;
      errors = there_errors;
    }
    if (!better) break;
  }
  return numbers;
}

/// Of what was fitted, and of what was held out.
bool is_better(const RunCost& after, const RunCost& before) {
  return after.held_out_per_row() < before.held_out_per_row() &&
         after.fitted_per_row() < before.fitted_per_row();
}

/// One more step from what was found in a part of the drive, by all of it, where that is better for all of
/// it; and what is known then.
std::optional<SystematicFit> fit_all(InnovationRuns& runs, const Places& places,
                                     const CalibratedNumbers& given, const MountedSensor& sensor,
                                     const InnovationFitOptions& fit, int landmarks,
                                     CalibratedNumbers& numbers) {
  const SystematicVector prior = prior_of(places, fit.prior);
  SystematicErrors errors(landmarks);
  const RunCost here = runs(numbers, 1, &errors);
  const auto step = errors.fit(prior, difference(places, given, numbers));
  if (!step || runs.stopped) return step;
  const CalibratedNumbers tried = moved(places, numbers, step->value, sensor);
  SystematicErrors there_errors(landmarks);
  const RunCost there = runs(tried, 1, &there_errors);
  if (there.lost || !(there.per_row() < here.per_row()) || !credible(tried, given, fit.prior)) return step;
  numbers = tried;
  return there_errors.fit(prior, difference(places, given, tried));
}

/// What the drive does not tell from what was given stays that: others gave it who knew more. Gives by how
/// much that moves each of the numbers.
Eigen::VectorXd move_what_is_told(const Eigen::MatrixXd& P, const std::vector<std::size_t>& what,
                                  const CalibratedNumbers& start, double keep_sigma, InnovationFit& result) {
  Eigen::VectorXd change(static_cast<Eigen::Index>(what.size()));
  for (std::size_t i = 0; i < what.size(); ++i)
    change[static_cast<Eigen::Index>(i)] = result.value[what[i]] - start[what[i]];
  const Eigen::VectorXd best = change;
  const std::vector<bool> kept = keep_given(P, keep_sigma, change);
  for (std::size_t i = 0; i < what.size(); ++i) {
    result.value[what[i]] = start[what[i]] + change[static_cast<Eigen::Index>(i)];
    result.kept[what[i]] = kept[i];
  }
  return change - best;
}

/// Half the time between two samples of what tells how the robot turns [s]: whether a rate is that of the
/// time before its stamp, about it or after it nobody says, and a picture looks as much older or younger.
double half_interval_s(std::span<const Sample> samples, bool gyro) {
  std::vector<double> apart_s;
  std::optional<SensorTime> last;
  for (const Sample& sample : samples) {
    if (gyro ? !std::holds_alternative<ImuSample>(sample) : !std::holds_alternative<Odometry>(sample))
      continue;
    if (last) apart_s.push_back(to_seconds(stamp_of(sample) - *last));
    last = stamp_of(sample);
  }
  return apart_s.empty() ? 0 : median(std::move(apart_s)) / 2;
}

/// What is known of each number, and which of them move. Where others stay as given, a number may be wrong by
/// what that moved it, too.
void settle(const Places& places, const SystematicFit& last, const CalibratedNumbers& given,
            const InnovationFitOptions& fit, const Eigen::Vector3d& lever, double stamps_s,
            InnovationFit& result) {
  SystematicMatrix about_sensor = SystematicMatrix::Identity();
  about_sensor.block<3, 3>(0, 3) = -SO3::hat(lever);
  const SystematicMatrix all = about_sensor * last.covariance * about_sensor.transpose();
  std::vector<std::size_t> what;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < kSystematic; ++i) {
    const auto& place = places[static_cast<std::size_t>(i)];
    if (!place) continue;
    what.push_back(*place);
    rows.push_back(i);
  }
  const Eigen::MatrixXd P = all(rows, rows);
  const Eigen::VectorXd moved = move_what_is_told(P, what, given, fit.keep_sigma, result);
  for (std::size_t i = 0; i < what.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double of_stamps = what[i] == at(Calibrated::CameraLatency) ? stamps_s : 0;
    const double sigma = std::hypot(std::max(std::sqrt(P(row, row)), std::abs(moved[row])), of_stamps);
    result.sigma[what[i]] = std::min(sigma, fit.prior[what[i]]);
    result.known[what[i]] = result.sigma[what[i]] < 0.5 * fit.prior[what[i]];
  }
}

}  // namespace

Result<InnovationFit> calibrate_by_innovations(std::span<const Sample> samples, const Landmarks& landmarks,
                                               const MountedSensor& sensor, const RiekfOptions& options,
                                               const InnovationFitOptions& fit) {
  const CalibratedNumbers given{0,
                                0,
                                0,
                                options.odometry_scale,
                                options.yaw_gain,
                                options.gyro_gain,
                                options.camera_latency_s,
                                options.sight_scale,
                                0,
                                0,
                                0,
                                1};
  InnovationFit result;
  result.value = given;
  const Places places = sought(samples, fit);
  const double stamps_s = half_interval_s(samples, places[9] == at(Calibrated::GyroGain));
  InnovationRuns runs(samples, landmarks, sensor, options, fit);
  const RunCost before = runs(given, 1);
  constexpr std::size_t kFewest = 50;
  if (!runs.stopped && before.observations < kFewest)
    return fail(ErrorCode::InvalidArgument, "too few observations of the map to calibrate by", {},
                "Drive past the tags of the map, with turns, for half a minute or more.");
  result.value = search(runs, places, given, sensor, fit, landmarks.size());
  const auto lever = [&](const InnovationFit& found) -> Eigen::Vector3d {
    return calibrated_sensor(sensor, found.value).base_T_sensor.translation();
  };
  InnovationFit judged = result;  // as the part says that is not held out
  SystematicErrors errors(landmarks.size());
  runs(judged.value, 1, &errors);
  const auto by_part = errors.fit(prior_of(places, fit.prior), difference(places, given, judged.value));
  if (by_part) settle(places, *by_part, given, fit, lever(judged), stamps_s, judged);
  const bool judged_better = is_better(runs(judged.value, 1), before);
  runs.holds_out = false;
  const auto last = fit_all(runs, places, given, sensor, fit, landmarks.size(), result.value);
  if (last) settle(places, *last, given, fit, lever(result), stamps_s, result);
  const RunCost after = runs(result.value, 1);
  if (runs.stopped) return fail(ErrorCode::InvalidArgument, "stopped before the search ended");
  result.cost_before = before.per_row();
  result.cost_after = after.per_row();
  result.held_out_before = before.held_out_per_row();
  result.held_out_after = after.held_out_per_row();
  result.changed = result.value != given;
  result.improved = last && result.changed && judged_better && is_better(after, before);
  result.runs = runs.runs;
  return result;
}

}  // namespace waymark
