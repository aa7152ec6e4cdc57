#include "waymark/localization/observed_motions.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <variant>

#include "waymark/localization/tag_fix.hpp"

namespace waymark {
namespace {

/// Everything that is needed to compute a pose from an image.
class SingleImagePose {
 public:
  SingleImagePose(const Landmarks& landmarks, const MountedSensor& sensor, const RiekfOptions& options)
      : landmarks_(landmarks), sensor_(sensor), options_(options), watch_(landmarks) {}

  [[nodiscard]] std::optional<TagFix> fix(const std::vector<Observation>& seen) const {
    std::optional<SE2> start = best_start(seen);
    if (!start) return std::nullopt;
    return fix_of(seen, landmarks_, watch_, sensor_, options_, *start, kMaxSigma_m);
  }

 private:
  struct Scored {
    SE2 map_T_base{};
    double score = 0;
  };

  /// Robust measure of the residuals of all observations at a pose, in chi-square units for small residuals.
  [[nodiscard]] double score(const SE2& map_T_base, const std::vector<Observation>& seen) const {
    constexpr double kHidden = 10;
    double sum = 0;
    for (const Observation& observation : seen) {
      const auto z = linearise(observation, landmarks_, sensor_, map_T_base);
      sum += z ? z->rows * std::log1p(z->residual.squaredNorm() / z->rows) : kHidden;
    }
    return sum;
  }

  [[nodiscard]] std::vector<Scored> starts(const std::vector<Observation>& seen) const {
    constexpr std::size_t kMaxObservations = 4;
    const std::size_t count = std::min(seen.size(), kMaxObservations);
    std::vector<Scored> all;
    for (std::size_t i = 0; i < count; ++i) {
      const Guesses guesses = guesses_of(seen[i], landmarks_, sensor_, options_);
      for (int g = 0; g < guesses.count; ++g)
        all.push_back({guesses.all[static_cast<std::size_t>(g)].map_T_base});
      for (std::size_t j = i + 1; guesses.count == 0 && j < count; ++j) {
        if (const auto guess = guess_of_pair(seen[i], seen[j], landmarks_, sensor_, options_))
          all.push_back({guess->map_T_base});
      }
    }
    for (Scored& start : all) start.score = score(start.map_T_base, seen);
    return all;
  }

  /// The pose that fits best; empty if a different one fits nearly as well.
  [[nodiscard]] std::optional<SE2> best_start(const std::vector<Observation>& seen) const {
    constexpr double kMinAdvantage = 6;
    constexpr double kDifferent_rad = 0.15;
    constexpr double kDifferent_m = 0.5;
    const std::vector<Scored> all = starts(seen);
    if (all.empty()) return std::nullopt;
    const Scored& best = *std::ranges::min_element(all, {}, &Scored::score);
    const bool ambiguous = std::ranges::any_of(all, [&](const Scored& other) {
      const SE2 apart = best.map_T_base.inverse() * other.map_T_base;
      const bool different =
          std::abs(apart.yaw()) > kDifferent_rad || apart.translation().norm() > kDifferent_m;
      return different && other.score < best.score + kMinAdvantage;
    });
    return ambiguous ? std::nullopt : std::optional(best.map_T_base);
  }

  static constexpr double kMaxSigma_m = 0.15;
  const Landmarks& landmarks_;
  const MountedSensor& sensor_;
  const RiekfOptions& options_;
  TagWatch watch_;
};

/// Observations in a sample; empty if it has none.
class SampleObservations {
 public:
  SampleObservations(const Landmarks& landmarks, const MountedSensor& sensor, const RiekfOptions& options)
      : landmarks_(landmarks), sensor_(sensor), options_(options) {}

  /// Adds the observations in a sample to those with the same stamp.
  void add(const Sample& sample, std::vector<Observation>& seen) const {
    if (const auto* frame = std::get_if<TagFrame>(&sample)) {
      for (const TagDetection& detection : frame->detections)
        keep(observation_of(detection, landmarks_, sensor_, options_, sensor_.camera_named(frame->camera)),
             seen);
    }
    if (const auto* frame = std::get_if<TagPoseFrame>(&sample)) {
      for (const SeenTagPose& pose : frame->tags)
        keep(observation_of(pose, landmarks_, sensor_, options_, sensor_.camera_named(frame->camera)), seen);
    }
    if (const auto* range = std::get_if<RangeBearing>(&sample))
      keep(observation_of(*range, landmarks_, sensor_, options_), seen);
  }

 private:
  static constexpr std::size_t kMaxObservations = 16;

  static void keep(const std::optional<Observation>& observation, std::vector<Observation>& seen) {
    if (observation && seen.size() < kMaxObservations) seen.push_back(*observation);
  }

  const Landmarks& landmarks_;
  const MountedSensor& sensor_;
  const RiekfOptions& options_;
};

bool observes(const Sample& sample) {
  return std::holds_alternative<TagFrame>(sample) || std::holds_alternative<TagPoseFrame>(sample) ||
         std::holds_alternative<RangeBearing>(sample);
}

ObservedMotion motion_between(const TagFix& from, const TagFix& to) {
  const Eigen::Matrix3d P = from.covariance + to.covariance;
  return {.from = from.stamp,
          .to = to.stamp,
          .twist = (from.map_T_base.inverse() * to.map_T_base).log(),
          .sigma_m = std::sqrt((P(0, 0) + P(1, 1)) / 2),
          .sigma_rad = std::sqrt(P(2, 2))};
}

/// Selects fixes about one second apart, and makes motions of them. Motions of a long drive leave gaps, so
/// that there are not more of them than are needed.
class MotionChain {
 public:
  explicit MotionChain(double duration_s)
      : pause_s_(std::max(0.0, duration_s / kMaxMotions - kMinDuration_s)) {}

  [[nodiscard]] bool wants(SensorTime stamp) const { return !wanted_ || stamp >= *wanted_; }

  void add(const TagFix& fix) {
    wanted_ = fix.stamp + seconds(kMinDuration_s);
    const bool continues = last_ && to_seconds(fix.stamp - last_->stamp) <= kMaxDuration_s;
    if (continues) motions_.push_back(motion_between(*last_, fix));
    last_ = fix;
    if (!continues || pause_s_ == 0) return;
    wanted_ = fix.stamp + seconds(pause_s_);
    last_.reset();
  }

  [[nodiscard]] std::vector<ObservedMotion> motions() && { return std::move(motions_); }

 private:
  static Duration seconds(double s) {
    return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(s));
  }

  static constexpr double kMaxMotions = 300;
  static constexpr double kMinDuration_s = 0.9;
  static constexpr double kMaxDuration_s = 1.6;
  double pause_s_;
  std::optional<SensorTime> wanted_{};
  std::optional<TagFix> last_{};
  std::vector<ObservedMotion> motions_{};
};

double duration_of_samples_s(std::span<const Sample> samples) {
  return samples.empty() ? 0 : to_seconds(stamp_of(samples.back()) - stamp_of(samples.front()));
}

}  // namespace

std::vector<ObservedMotion> observed_motions(std::span<const Sample> samples, const Landmarks& landmarks,
                                             const MountedSensor& sensor, const RiekfOptions& options) {
  const SampleObservations observations(landmarks, sensor, options);
  const SingleImagePose poses(landmarks, sensor, options);
  const auto latency =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(options.camera_latency_s));
  MotionChain chain(duration_of_samples_s(samples));
  for (std::size_t i = 0; i < samples.size();) {
    const SensorTime stamp = stamp_of(samples[i]);
    std::vector<Observation> seen;
    std::size_t end = i;
    for (; end < samples.size() && stamp_of(samples[end]) == stamp; ++end) {
      if (observes(samples[end]) && chain.wants(stamp - latency)) observations.add(samples[end], seen);
    }
    i = end;
    if (seen.empty()) continue;
    auto fix = poses.fix(seen);
    if (!fix) continue;
    fix->stamp = stamp - latency;
    chain.add(*fix);
  }
  return std::move(chain).motions();
}

}  // namespace waymark
