#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <set>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// The kinds of samples whose stamps an estimator compares with each other.
enum class StampedKind : std::uint8_t {
  Observations,  ///< images, tags, tag poses, ranges and bearings
  Odometry,
  Imu,
  Truth,
};

/// The kind of a sample; `nullopt` if no estimator compares its stamp with that of an observation.
[[nodiscard]] std::optional<StampedKind> stamped_kind(const Sample& sample);

/// Kinds of samples that must not be used, because they were recorded at other times than the observations.
struct OtherClock {
  std::set<StampedKind> kinds{};
  Error error{};  ///< InvalidArgument, names the kinds
};

/// Whether samples of this kind were left out because of their clock.
[[nodiscard]] inline bool affects(const std::optional<OtherClock>& other, StampedKind kind) {
  return other && other->kinds.contains(kind);
}

/// Finds the kinds of samples that were recorded at other times than the observations. Either they were
/// stamped by another clock, or they are from another drive. An estimator must not use them.
class ClockCheck {
 public:
  /// A stamp of zero is ignored, because it was never set.
  void add(StampedKind kind, SensorTime stamp);
  /// The same for any sample.
  void add(const Sample& sample);

  /// Whether samples of this kind may be used: they overlap the observations in time, or there are none of
  /// either kind.
  [[nodiscard]] bool overlaps(StampedKind kind) const { return !apart_s(kind); }
  /// Time from the beginning of the observations to the beginning of this kind [s], either of which may be
  /// the first. `nullopt` if it overlaps the observations.
  [[nodiscard]] std::optional<double> apart_s(StampedKind kind) const;
  /// All kinds that must not be used. `nullopt` if there are none.
  [[nodiscard]] std::optional<OtherClock> mismatch() const;

 private:
  struct Range {
    SensorTime first{};
    SensorTime last{};
    bool empty = true;
  };
  std::array<Range, 4> ranges_{};
};

}  // namespace waymark
