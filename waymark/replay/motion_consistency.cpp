#include "waymark/replay/motion_consistency.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace waymark {
namespace {

/// Deviations that count as the uncertainty of a pose by the tags of one picture.
constexpr double kPictureSigmas = 3;
/// Two of this many pictures and one more must contradict: noise hides the one between them.
constexpr std::size_t kSuspectedFor = 3;
/// What is slow, or comes and goes, shows over a longer window.
constexpr double kLongWindow_s = 3;

}  // namespace

MotionConsistency::MotionConsistency(const ConsistencyOptions& options, const ActuatorOptions& actuators,
                                     const OdometryPrior& odometry)
    : options_(options), sums_(actuators, odometry, std::max(options.window_s, kLongWindow_s)) {}

void MotionConsistency::add(const Odometry& odometry) {
  if (sums_.add(odometry)) return;
  headings_.clear();
  forget_pictures();
}

void MotionConsistency::observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags) {
  notice(sums_.observe(map_T_base, covariance, tags));
}

void MotionConsistency::observe_nothing() { notice(sums_.observe_nothing()); }

void MotionConsistency::notice(const Standing& standing) {
  if (standing.stands) forget_pictures();
  if (const auto& over = standing.over)
    carried_ = find_carry(over->before, over->after, over->stood_s, options_);
}

void MotionConsistency::forget() {
  sums_.forget();
  carried_.reset();
  forget_pictures();
  headings_.clear();
  late_.reset();
}

void MotionConsistency::forget_pictures() {
  pictures_.clear();
  suspected_ago_.reset();
  pictured_.reset();
}

void MotionConsistency::observe_picture(SensorTime stamp, const SE2& map_T_base,
                                        const Eigen::Matrix3d& covariance, bool accepted) {
  std::optional<MotionSample> picture = sums_.at(stamp);
  if (!picture) return;
  add_heading(stamp, map_T_base.yaw());
  if (pictures_.empty()) picture_zero_ = stamp;
  picture->moving_s = to_seconds(stamp - picture_zero_);
  picture->tags = true;
  if (!pictures_.empty() && picture->moving_s <= pictures_.back().seen.moving_s) return;
  MotionSample estimated = *picture;
  const MotionSample& now = sums_.now();
  estimated.map_T_base = now.map_T_base * (now.odom_T_base.inverse() * picture->odom_T_base);
  estimated.covariance = now.covariance;
  estimated.tags = now.tags;
  picture->map_T_base = map_T_base;
  picture->covariance = covariance;
  pictures_.push_back({*picture, estimated});
  while (picture->moving_s - pictures_.front().seen.moving_s > kLongWindow_s + kMotionGap_s)
    pictures_.pop_front();
  std::optional<Contradiction> found = contradiction_of_pictures();
  if (!found && accepted) found = push_of_pictures();
  if (suspected_ago_ && ++*suspected_ago_ > kSuspectedFor) suspected_ago_.reset();
  if (!found) return;
  if (suspected_ago_) pictured_ = found;
  suspected_ago_ = 0;
}

void MotionConsistency::add_heading(SensorTime stamp, double yaw_rad) {
  constexpr double kUnseen_s = 1;  // longer, and nobody knows how often it turned round
  const double time_s = to_seconds(stamp - *sums_.zero());
  if (!headings_.empty() && time_s <= headings_.back().time_s) return;
  if (!headings_.empty() && time_s - headings_.back().time_s > kUnseen_s) headings_.clear();
  const double before = headings_.empty() ? yaw_rad : headings_.back().yaw_rad;
  headings_.push_back({time_s, before + internal::straight(yaw_rad - before)});
  look_for_delay();
}

/// Now and then: whether turns seen by tags follow those of odometry.
void MotionConsistency::look_for_delay() {
  constexpr std::size_t kEvery = 8;
  constexpr std::size_t kKept = 120;
  constexpr double kMost_s = 0.8;
  constexpr double kBeyondNoise = 3;
  if (headings_.size() < kKept) return;
  std::vector<HeadingAt> turned;
  const bool gyro = sums_.scales().gyro;
  for (const StampedSums& at : sums_.history())
    turned.push_back({to_seconds(at.stamp - *sums_.zero()), gyro ? at.sums.gyro_rad : at.sums.wheels_rad});
  const auto found = find_delay(headings_, turned, kMost_s);
  headings_.erase(headings_.begin(), headings_.begin() + kEvery);
  if (!found || found->delay_s < options_.late_pictures_s) return;
  // A random walk of turns by wheels fits one delay or another better, too.
  const double path_m = sums_.history().back().sums.path_m - sums_.history().front().sums.path_m;
  const double walk_rad = gyro ? 0.0 : sums_.scales().turn_noise_sqrt_m * std::sqrt(path_m / 6);
  if (found->rms_undelayed_rad < kBeyondNoise * walk_rad) return;
  late_ = Contradiction{.one = gyro ? MotionSource::Gyro : MotionSource::Wheels,
                        .other = MotionSource::Tags,
                        .turning = true,
                        .apart = found->rms_undelayed_rad,
                        .late_s = found->delay_s};
}

/// The newest picture before a moment; nothing where pictures were missing then, or are since.
std::optional<MotionConsistency::PictureIterator> MotionConsistency::picture_before(double moving_s) const {
  const auto time_of = [](const Picture& picture) { return picture.seen.moving_s; };
  const auto after = std::ranges::upper_bound(pictures_, moving_s + 1e-9, {}, time_of);
  if (after == pictures_.begin()) return std::nullopt;
  const auto found = std::prev(after);
  const auto silent = [&](const Picture& a, const Picture& b) {
    return time_of(b) - time_of(a) > kMotionGap_s;
  };
  if (moving_s - time_of(*found) > kMotionGap_s ||
      std::adjacent_find(found, pictures_.end(), silent) != pictures_.end())
    return std::nullopt;
  return found;
}

/// Over windows that grow: what is fast shows in the shortest. Of the beginning the estimate often knows more
/// than one picture; it knows less where it has followed wheels that slipped.
std::optional<Contradiction> MotionConsistency::contradiction_of_pictures() const {
  MotionScales known = sums_.scales();
  known.sigmas = kPictureSigmas;
  const double now = pictures_.back().seen.moving_s;
  for (const double longer : {1.0, 1.5, 2.0, 2.5, 3.0}) {
    const auto from = picture_before(now - longer * options_.window_s);
    if (!from) return std::nullopt;
    std::vector<MotionSample> window;
    std::transform(*from, pictures_.end(), std::back_inserter(window),
                   [](const Picture& picture) { return picture.seen; });
    if (auto found = find_tag_contradiction(window, known, options_)) return found;
    window.front() = (*from)->estimated;
    if (auto found = find_tag_contradiction(window, known, options_)) return found;
  }
  return std::nullopt;
}

/// Against two pictures of a moment ago, so that one wrong picture says nothing.
std::optional<Contradiction> MotionConsistency::push_of_pictures() const {
  MotionScales known = sums_.scales();
  known.sigmas = kPictureSigmas;
  const MotionSample& newest = pictures_.back().seen;
  for (const double part : {0.5, 1.0}) {
    const auto first =
        std::ranges::lower_bound(pictures_, newest.moving_s - part * options_.window_s - 1e-9, {},
                                 [](const Picture& picture) { return picture.seen.moving_s; });
    if (pictures_.end() - first < 4) continue;
    const auto found = find_push(first->seen, newest, known, options_);
    if (found && find_push(std::next(first)->seen, newest, known, options_)) return found;
  }
  return std::nullopt;
}

std::optional<Contradiction> MotionConsistency::contradiction() const {
  if (carried_) return carried_;
  if (const double repeats_s = sums_.gyro_repeats_s(); repeats_s >= options_.window_s)
    return Contradiction{.one = MotionSource::Gyro,
                         .other = MotionSource::Commands,
                         .turning = true,
                         .repeats_s = repeats_s,
                         .culprit = MotionSource::Gyro};
  const std::deque<MotionSample>& samples = sums_.samples();
  if (samples.empty()) return std::nullopt;
  const auto newest = std::ranges::lower_bound(samples, samples.back().moving_s - options_.window_s - 1e-9,
                                               {}, &MotionSample::moving_s);
  if (auto found = find_contradiction({newest, samples.end()}, sums_.scales(), options_)) return found;
  if (pictured_) return pictured_;
  if (late_) return late_;
  ConsistencyOptions longer = options_;
  longer.window_s = std::max(options_.window_s, kLongWindow_s);
  return find_contradiction({samples.begin(), samples.end()}, sums_.scales(), longer);
}

}  // namespace waymark
