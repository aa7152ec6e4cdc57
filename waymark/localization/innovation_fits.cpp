#include "waymark/localization/innovation_fits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <variant>

#include "waymark/base/order_statistics.hpp"

namespace waymark {

std::vector<bool> keep_given(const Eigen::MatrixXd& covariance, double enough_sigma,
                             Eigen::VectorXd& change) {
  std::vector<bool> kept(static_cast<std::size_t>(change.size()), false);
  Eigen::MatrixXd P = covariance;  // covariance of the parameters that may still change
  for (;;) {
    Eigen::Index least = -1;
    double least_sigmas = enough_sigma;
    for (Eigen::Index i = 0; i < change.size(); ++i) {
      if (kept[static_cast<std::size_t>(i)]) continue;
      const double sigmas = std::abs(change[i]) / std::sqrt(P(i, i));
      if (sigmas >= least_sigmas) continue;
      least = i;
      least_sigmas = sigmas;
    }
    if (least < 0) return kept;
    kept[static_cast<std::size_t>(least)] = true;
    const Eigen::VectorXd by = P.col(least) / P(least, least);
    change -= by * change[least];
    P -= by * P.row(least).eval();
    change[least] = 0;
  }
}

// Names of the calibrated parameters, and the sensor and options with the parameters applied.

std::string_view to_string(Calibrated what) {
  constexpr std::array<std::string_view, kCalibrated> kNames = {
      "mounting_x_m", "mounting_y_m",      "mounting_yaw_rad",   "odometry_scale",
      "yaw_scale",    "gyro_gain",         "camera_latency_s",   "sight_scale",
      "mounting_z_m", "mounting_roll_rad", "mounting_pitch_rad", "focal_scale"};
  return kNames.at(static_cast<std::size_t>(what));
}

MountedSensor calibrated_sensor(const MountedSensor& sensor, const CalibratedNumbers& numbers) {
  MountedSensor moved = sensor;
  const SE3& T = sensor.base_T_sensor;
  moved.base_T_sensor = SE3(SO3::exp({numbers[9], numbers[10], numbers[2]}) * T.rotation(),
                            T.translation() + Eigen::Vector3d(numbers[0], numbers[1], numbers[8]));
  if (!sensor.camera || numbers[11] == 1) return moved;
  CameraModel::Projection projection = sensor.camera->projection();
  std::visit(
      [&](auto& p) {
        p.fx *= numbers[11];
        p.fy *= numbers[11];
      },
      projection);
  const auto camera = CameraModel::make(projection, sensor.camera->width_px(), sensor.camera->height_px());
  if (camera) moved.camera = *camera;
  return moved;
}

RiekfOptions calibrated_options(const RiekfOptions& options, const CalibratedNumbers& numbers) {
  RiekfOptions out = options;
  out.odometry_scale = numbers[3];
  out.yaw_scale = numbers[4];
  out.gyro_gain = numbers[5];
  out.camera_latency_s = numbers[6];
  out.sight_scale = numbers[7];
  return out;
}

// Implementation of calibrate_by_innovations().
namespace {

constexpr double kCapPerRow = 16;  ///< maximum cost per row of an outlier
constexpr int kStretches = 12;     ///< segments per drive; every third one is held out

/// Cost of one run of the filter, computed from its innovations.
struct RunCost {
  double fitted = 0;       ///< sum of NIS over the fitted part, with outliers capped
  double fitted_rows = 0;  ///< degrees of freedom
  double held_out = 0;     ///< like `fitted`, for the held-out part
  double held_out_rows = 0;
  std::size_t observations = 0;
  bool lost = false;  ///< the filter was lost for longer than with other parameters; unprocessed observations
                      ///< would cost nothing

  [[nodiscard]] double rows() const { return fitted_rows + held_out_rows; }
  [[nodiscard]] double per_row() const { return rows() > 0 ? (fitted + held_out) / rows() : 0; }
  [[nodiscard]] double held_out_per_row() const { return held_out_rows > 0 ? held_out / held_out_rows : 0; }
  /// The cost that the search compares.
  [[nodiscard]] double fitted_per_row() const {
    return lost || !(fitted_rows > 0) ? std::numeric_limits<double>::infinity() : fitted / fitted_rows;
  }
};

/// Runs the filter over one drive with different sets of parameters.
class InnovationRuns {
 public:
  InnovationRuns(std::span<const Sample> samples, const Landmarks& landmarks, const MountedSensor& sensor,
                 const RiekfOptions& options, const InnovationFitOptions& fit)
      : samples_(samples),
        landmarks_(landmarks),
        sensor_(sensor),
        options_(options),
        keep_going_(fit.keep_going) {
    // The errors to be found must show up in the innovations, so other states must not absorb them.
    options_.mounting_sigma_m = options_.mounting_sigma_rad = 0;
    options_.motion.distance_scale_sigma = options_.motion.yaw_scale_sigma = 0;
    constexpr double kSlip_s = 0.01;
    options_.motion.slip_sigma_s = std::min(options_.motion.slip_sigma_s, kSlip_s);
    options_.motion.independent_parts = true;
  }

  /// Runs the filter with observation noise scaled by `noise_ratio`, which is large at first so that outliers
  /// are accepted. `errors` receives the evidence from the part that is not held out.
  RunCost operator()(const CalibratedNumbers& numbers, double noise_ratio,
                     SystematicErrors* errors = nullptr) {
    stopped = stopped || (keep_going_ && !keep_going_());
    RunCost cost;
    if (stopped) return cost;
    ++runs;
    RiekfLocalizer filter(landmarks_, calibrated_sensor(sensor_, numbers),
                          calibrated_options(widened(noise_ratio), numbers));
    if (errors != nullptr) filter.tracker().systematic().keep_clusters();
    for (const Sample& sample : samples_) {
      filter.tracker().systematic().count_in(!holds_out || !held_out(stamp_of(sample)));
      if (const auto* odometry = std::get_if<Odometry>(&sample)) filter.add(*odometry);
      if (const auto* imu = std::get_if<ImuSample>(&sample)) filter.add(*imu);
      if (const auto* tags = std::get_if<TagFrame>(&sample)) filter.add(*tags);
      if (const auto* tags = std::get_if<TagPoseFrame>(&sample)) filter.add(*tags);
      if (const auto* seen = std::get_if<RangeBearing>(&sample)) filter.add(*seen);
      take(filter, cost);
    }
    if (errors != nullptr) *errors = filter.tracker().systematic();
    constexpr double kKept = 0.9;
    most_rows_ = std::max(most_rows_, cost.rows());
    cost.lost = cost.rows() < kKept * most_rows_;
    return cost;
  }

  int runs = 0;
  bool holds_out = true;  ///< whether a third of the drive is withheld from `errors`
  bool stopped = false;   ///< `keep_going` ended the search; later runs are invalid

 private:
  [[nodiscard]] RiekfOptions widened(double ratio) const {
    RiekfOptions wide = options_;
    wide.corner_noise_ratio *= ratio;
    wide.point_sigma_m *= ratio;
    wide.range_sigma_m *= ratio;
    wide.bearing_sigma_rad *= ratio;
    return wide;
  }

  void take(RiekfLocalizer& filter, RunCost& cost) const {
    for (const NisRecord& record : filter.comparisons()) {
      const double nis = std::min(record.nis, kCapPerRow * record.rows);
      const bool held = held_out(record.stamp);
      (held ? cost.held_out : cost.fitted) += nis;
      (held ? cost.held_out_rows : cost.fitted_rows) += record.rows;
      ++cost.observations;
    }
    filter.clear_comparisons();
  }

  [[nodiscard]] bool held_out(SensorTime stamp) const {
    const SensorTime first = stamp_of(samples_.front());
    const double share =
        to_seconds(stamp - first) / std::max(1e-9, to_seconds(stamp_of(samples_.back()) - first));
    return static_cast<int>(share * kStretches) % 3 == 2;
  }

  std::span<const Sample> samples_;
  const Landmarks& landmarks_;
  MountedSensor sensor_;
  RiekfOptions options_;
  std::function<bool()> keep_going_;
  double most_rows_ = 0;  ///< maximum over all runs
};

constexpr std::size_t at(Calibrated what) { return static_cast<std::size_t>(what); }

/// The calibrated parameter that each entry of kSystematic corresponds to; empty if it is not fitted.
using Places = std::array<std::optional<std::size_t>, kSystematic>;

/// The parameters that are both requested and observable. With a gyro, the turn is not measured by the
/// wheels; without one, there is no gyro scale. The height and tilt of a camera and its focal length can only
/// be determined from corners.
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
                gyro ? at(Calibrated::GyroGain) : at(Calibrated::YawScale)};
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

/// The change that takes the parameters from `from` to `to`.
SystematicVector difference(const Places& places, const CalibratedNumbers& from,
                            const CalibratedNumbers& to) {
  SystematicVector change = SystematicVector::Zero();
  for (Eigen::Index i = 0; i < kSystematic; ++i)
    if (const auto& place = places[static_cast<std::size_t>(i)]) change[i] = to[*place] - from[*place];
  return change;
}

/// In kSystematic, a rotation of the mounting is about the origin of base; in Calibrated, it is about the
/// sensor.
CalibratedNumbers moved(const Places& places, const CalibratedNumbers& numbers, SystematicVector change,
                        const MountedSensor& sensor) {
  const Eigen::Vector3d lever = calibrated_sensor(sensor, numbers).base_T_sensor.translation();
  change.head<3>() += change.segment<3>(3).cross(lever);
  CalibratedNumbers to = numbers;
  for (Eigen::Index i = 0; i < kSystematic; ++i)
    if (const auto& place = places[static_cast<std::size_t>(i)]) to[*place] += change[i];
  return to;
}

/// Whether the parameters are within three standard deviations of their initial values. If not, the search
/// has diverged.
bool credible(const CalibratedNumbers& numbers, const CalibratedNumbers& start,
              const CalibratedNumbers& prior) {
  constexpr double kMaxSigmas = 3;
  for (std::size_t i = 0; i < kCalibrated; ++i)
    if (std::abs(numbers[i] - start[i]) > kMaxSigmas * prior[i]) return false;
  return true;
}

/// Tries several latencies so that the result does not depend on the given one, because the innovations are
/// least linear in the latency.
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

/// The smallest of these noise ratios at which the filter initialises and keeps accepting tags.
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

/// Takes Gauss-Newton steps on the innovations, with noise that shrinks to its actual value. If the noise
/// were small from the start, outliers and gates would bias the steps (graduated non-convexity; Blake and
/// Zisserman, "Visual Reconstruction", chapter 3).
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
    if (!step) continue;  // the estimate was so uncertain that the filter never initialised
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

/// Whether the fit improved on both the fitted and the held-out part.
bool is_better(const RunCost& after, const RunCost& before) {
  return after.held_out_per_row() < before.held_out_per_row() &&
         after.fitted_per_row() < before.fitted_per_row();
}

/// Takes one more step on the whole drive, starting at the result for the fitted part. The step is kept only
/// if the cost for the whole drive decreases. Returns the final fit.
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

/// If the drive does not distinguish a given value from the fitted one, the given value is kept, because it
/// came from a better source. Returns by how much this moves each parameter.
Eigen::VectorXd move_observable(const Eigen::MatrixXd& P, const std::vector<std::size_t>& what,
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

/// Half the interval between two samples from the rotation source [s]. A rate may refer to the time before,
/// around or after its stamp, which shifts the apparent latency by this much.
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

/// Sets the values, their standard deviations, and which parameters change. If other parameters keep their
/// given values, the resulting shift is added to the standard deviation.
void set_values_and_sigmas(const Places& places, const SystematicFit& last, const CalibratedNumbers& given,
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
  const Eigen::VectorXd moved = move_observable(P, what, given, fit.keep_sigma, result);
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
                                options.yaw_scale,
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
  constexpr std::size_t kMinObservations = 50;
  if (!runs.stopped && before.observations < kMinObservations)
    return fail(ErrorCode::InvalidArgument, "too few observations of map tags for a calibration", {},
                "Drive past the tags of the map, with turns, for half a minute or more.");
  result.value = search(runs, places, given, sensor, fit, landmarks.size());
  const auto lever = [&](const InnovationFit& found) -> Eigen::Vector3d {
    return calibrated_sensor(sensor, found.value).base_T_sensor.translation();
  };
  InnovationFit judged = result;  // result for the part that is not held out
  SystematicErrors errors(landmarks.size());
  runs(judged.value, 1, &errors);
  const auto by_part = errors.fit(prior_of(places, fit.prior), difference(places, given, judged.value));
  if (by_part) set_values_and_sigmas(places, *by_part, given, fit, lever(judged), stamps_s, judged);
  const bool judged_better = is_better(runs(judged.value, 1), before);
  runs.holds_out = false;
  const auto last = fit_all(runs, places, given, sensor, fit, landmarks.size(), result.value);
  if (last) set_values_and_sigmas(places, *last, given, fit, lever(result), stamps_s, result);
  const RunCost after = runs(result.value, 1);
  if (runs.stopped) return fail(ErrorCode::InvalidArgument, "calibration stopped before it was complete");
  result.cost_before = before.per_row();
  result.cost_after = after.per_row();
  result.held_out_before = before.held_out_per_row();
  result.held_out_after = after.held_out_per_row();
  result.changed = result.value != given;
  result.improved = last && result.changed && judged_better && is_better(after, before);
  result.runs = runs.runs;
  return result;
}

namespace {

/// Base-2 logarithms of the ratios for motion, turn, sensor and tag.
using Exponents = std::array<double, 4>;

RiekfOptions with(const RiekfOptions& options, const Exponents& e) {
  RiekfOptions out = options;
  const double motion = std::exp2(e[0]);
  const double turn = std::exp2(e[1]);
  const double sensor = std::exp2(e[2]);
  const double tag = std::exp2(e[3]);
  out.motion.along_m_sqrt_m *= motion;
  out.motion.across_m_sqrt_m *= motion;
  out.motion.drift_m_sqrt_s *= motion;
  out.motion.yaw_rad_sqrt_m *= turn;
  out.motion.yaw_rad_sqrt_rad *= turn;
  out.motion.yaw_rad_sqrt_s *= turn;
  out.corner_noise_ratio *= sensor;
  out.point_sigma_m *= sensor;
  out.point_sigma_share *= sensor;
  out.range_sigma_m *= sensor;
  out.bearing_sigma_rad *= sensor;
  out.tag_sigma_m *= tag;
  out.tag_sigma_rad *= tag;
  return out;
}

class Likelihood {
 public:
  Likelihood(std::span<const Sample> samples, const Landmarks& landmarks, const MountedSensor& sensor,
             const RiekfOptions& options, const std::function<bool()>& keep_going)
      : samples_(samples),
        landmarks_(landmarks),
        sensor_(sensor),
        options_(options),
        keep_going_(keep_going) {}

  /// Twice the negative log-likelihood, without its constant term.
  double operator()(const Exponents& e) {
    constexpr double kWeightOfMeans = 10;
    stopped = stopped || (keep_going_ && !keep_going_());
    if (stopped) return std::numeric_limits<double>::infinity();
    RiekfLocalizer filter(landmarks_, sensor_, with(options_, e));
    const double of_unit = 2 * std::log(std::exp2(e[2]));  // residuals are whitened by their own noise
    double sum = 0;
    double rows = 0;
    for (const Sample& sample : samples_) {
      if (const auto* odometry = std::get_if<Odometry>(&sample)) filter.add(*odometry);
      if (const auto* imu = std::get_if<ImuSample>(&sample)) filter.add(*imu);
      if (const auto* tags = std::get_if<TagFrame>(&sample)) filter.add(*tags);
      if (const auto* tags = std::get_if<TagPoseFrame>(&sample)) filter.add(*tags);
      if (const auto* seen = std::get_if<RangeBearing>(&sample)) filter.add(*seen);
      for (const NisRecord& record : filter.comparisons()) {
        sum += std::min(record.nis, kCapPerRow * record.rows) + record.log_det + of_unit * record.rows;
        rows += record.rows;
      }
      filter.clear_comparisons();
    }
    const LastingErrors& means = filter.tracker().lasting();
    sum += kWeightOfMeans * (means.cost() + of_unit * means.degrees_of_freedom());
    return rows > 0 ? sum / rows : std::numeric_limits<double>::infinity();
  }

  bool stopped = false;

 private:
  std::span<const Sample> samples_;
  const Landmarks& landmarks_;
  const MountedSensor& sensor_;
  const RiekfOptions& options_;
  const std::function<bool()>& keep_going_;
};

/// The first 150 s, which are sufficient to estimate the noise.
std::span<const Sample> beginning(std::span<const Sample> samples) {
  constexpr Duration kLong = std::chrono::seconds(150);
  const auto end = std::ranges::upper_bound(samples, stamp_of(samples.front()) + kLong, {},
                                            [](const Sample& s) { return stamp_of(s); });
  return samples.subspan(0, static_cast<std::size_t>(end - samples.begin()));
}

}  // namespace

bool noise_is_inconsistent(double nis_per_row, std::optional<double> lasting_nis) {
  constexpr double kNis = 1.6;
  constexpr double kLasting = 4;
  return nis_per_row > kNis || lasting_nis.value_or(0) > kLasting;
}

NoiseFit adapt_noise(std::span<const Sample> samples, const Landmarks& landmarks, const MountedSensor& sensor,
                     const RiekfOptions& options, const std::function<bool()>& keep_going) {
  NoiseFit fit{.options = options, .tag_sigma_m = options.tag_sigma_m};
  if (samples.empty()) return fit;
  Likelihood cost(beginning(samples), landmarks, sensor, options, keep_going);
  Exponents best{};
  double least = cost(best);
  constexpr double kMinExponent = -1;  // relative to the assumed noise; lasting errors hide anything smaller
  constexpr double kMaxExponent = 7;
  constexpr double kMinDecrease = 1e-3;  // minimum decrease in cost per row
  for (const double step : {2.0, 2.0, 1.0, 0.5}) {
    for (std::size_t i = 0; i < best.size(); ++i) {
      for (const double direction : {step, -step}) {
        bool better = false;
        for (;;) {
          Exponents tried = best;
          tried[i] += direction;
          if (tried[i] < kMinExponent || tried[i] > kMaxExponent) break;
          const double there = cost(tried);
          if (!(there < least - kMinDecrease)) break;
          best = tried;
          least = there;
          better = true;
        }
        if (better) break;
      }
    }
  }
  if (cost.stopped) return fit;
  fit.adapted = std::ranges::any_of(best, [](double e) { return e != 0; });
  fit.options = with(options, best);
  fit.motion_ratio = std::exp2(best[0]);
  fit.turn_ratio = std::exp2(best[1]);
  fit.sensor_ratio = std::exp2(best[2]);
  fit.tag_sigma_m = fit.options.tag_sigma_m;
  return fit;
}

}  // namespace waymark
