#include "waymark/localization/noise_adaptation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <variant>

namespace waymark {
namespace {

/// Base-2 logarithms of the ratios: motion, turn, sensor, tag.
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

  /// Twice its negative logarithm, without its constant.
  double operator()(const Exponents& e) {
    constexpr double kCapPerRow = 16;
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
    sum += kWeightOfMeans * (means.cost() + of_unit * means.freedom());
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

/// The first minutes say what the noise is.
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
  constexpr double kLeast = -1;  // of what is assumed: smaller noise hides in errors that last
  constexpr double kMost = 7;
  constexpr double kWorth = 1e-3;  // per row
  for (const double step : {2.0, 2.0, 1.0, 0.5}) {
    for (std::size_t i = 0; i < best.size(); ++i) {
      for (const double direction : {step, -step}) {
        bool better = false;
        for (;;) {
          Exponents tried = best;
          tried[i] += direction;
          if (tried[i] < kLeast || tried[i] > kMost) break;
          const double there = cost(tried);
          if (!(there < least - kWorth)) break;
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
