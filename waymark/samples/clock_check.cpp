#include "waymark/samples/clock_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr std::array kCheckedKinds = {std::pair(StampedKind::Odometry, "odometry"),
                                      std::pair(StampedKind::Imu, "IMU data"),
                                      std::pair(StampedKind::Truth, "ground truth")};

/// "odometry is not used, nor is IMU data"
std::string not_used(const std::vector<const char*>& names) {
  std::string text = fmt::format("{} is not used", names.front());
  for (std::size_t i = 1; i < names.size(); ++i)
    text += fmt::format("{} {}", i == 1 ? ", nor is" : " or", names[i]);
  return text;
}

}  // namespace

std::optional<StampedKind> stamped_kind(const Sample& sample) {
  if (std::holds_alternative<Odometry>(sample)) return StampedKind::Odometry;
  if (std::holds_alternative<ImuSample>(sample)) return StampedKind::Imu;
  if (std::holds_alternative<TruthPose>(sample)) return StampedKind::Truth;
  const bool observes =
      std::holds_alternative<TagFrame>(sample) || std::holds_alternative<TagPoseFrame>(sample) ||
      std::holds_alternative<RangeBearing>(sample) || std::holds_alternative<CameraFrame>(sample);
  return observes ? std::optional(StampedKind::Observations) : std::nullopt;
}

void ClockCheck::add(StampedKind kind, SensorTime stamp) {
  if (stamp == SensorTime{}) return;
  Range& range = ranges_[static_cast<std::size_t>(kind)];
  if (std::exchange(range.empty, false)) range.first = range.last = stamp;
  range.first = std::min(range.first, stamp);
  range.last = std::max(range.last, stamp);
}

void ClockCheck::add(const Sample& sample) {
  if (const auto kind = stamped_kind(sample)) add(*kind, stamp_of(sample));
}

std::optional<double> ClockCheck::apart_s(StampedKind kind) const {
  constexpr double kMinGap_s = 1.0;  // sensors do not start and stop at exactly the same time
  const Range& seen = ranges_[static_cast<std::size_t>(StampedKind::Observations)];
  const Range& other = ranges_[static_cast<std::size_t>(kind)];
  if (seen.empty || other.empty) return std::nullopt;
  // As doubles, because the difference of two arbitrary stamps can exceed 64 bits.
  const auto seconds = [](SensorTime from, SensorTime to) {
    return to_seconds(to.time_since_epoch()) - to_seconds(from.time_since_epoch());
  };
  const double gap_s = std::max(seconds(seen.last, other.first), seconds(other.last, seen.first));
  if (gap_s < kMinGap_s) return std::nullopt;
  return std::abs(seconds(seen.first, other.first));
}

std::optional<OtherClock> ClockCheck::mismatch() const {
  OtherClock other;
  std::vector<const char*> names;
  double apart = 0;
  for (const auto& [kind, name] : kCheckedKinds) {
    const auto apart_of_kind_s = apart_s(kind);
    if (!apart_of_kind_s) continue;
    if (names.empty()) apart = *apart_of_kind_s;
    names.push_back(name);
    other.kinds.insert(kind);
  }
  if (names.empty()) return std::nullopt;
  other.error = {ErrorCode::InvalidArgument,
                 fmt::format("{} and images are stamped by two clocks ({:.{}f} s apart): {}", names.front(),
                             apart, apart < 100 ? 1 : 0, not_used(names)),
                 {},
                 "Stamp all sensors by one clock, and read only files from one drive together."};
  return other;
}

}  // namespace waymark
