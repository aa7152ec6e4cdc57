#include "waymark/robots/process/robot_clock.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace waymark {
namespace {
constexpr Duration kWindow = std::chrono::seconds(10);
}  // namespace

void ArrivalClock::receive(SensorTime stamp, Duration arrived) {
  const Duration difference = arrived - stamp.time_since_epoch();
  if (!least_) window_began_ = arrived;
  if (least_ && arrived - window_began_ > kWindow) {
    before_ = least_;
    least_ = difference;
    window_began_ = arrived;
  }
  least_ = least_ ? std::min(*least_, difference) : difference;
}

std::optional<SensorTime> ArrivalClock::at(Duration now) const {
  if (!least_) return std::nullopt;
  return SensorTime(now - std::min(*least_, before_.value_or(*least_)));
}

namespace {

constexpr Duration kMaxDeviation = std::chrono::seconds(1);  // no image takes longer than this to arrive
constexpr int kMean = 100;
constexpr Duration kSetAfter = std::chrono::seconds(1);  // a few messages may come from a different node
constexpr Duration kSameOffset = std::chrono::milliseconds(200);

}  // namespace

/// The error for a timestamp with this offset: either the robot's clock was set, or the timestamp is from a
/// different clock.
Error StampGate::refused(const std::string& topic, Duration offset, Duration arrived, bool leads) {
  if (leads && (!other_ || std::chrono::abs(offset - other_->offset) > kSameOffset))
    other_ = {.offset = offset, .since = arrived};
  const double late_s = to_seconds(offset - *offset_);
  if (leads && arrived - other_->since >= kSetAfter)
    return {ErrorCode::Unreadable,
            fmt::format("the robot's clock was set {} by {:.1f} s: restart this command",
                        late_s > 0 ? "back" : "forward", std::abs(late_s)),
            {.key = topic}};
  return {ErrorCode::Unreadable,
          fmt::format("its stamp is {:.1f} s {} relative to the odometry's clock", std::abs(late_s),
                      late_s > 0 ? "in the past" : "in the future"),
          {.key = topic},
          "Synchronise the clocks of the robot's computers."};
}

Status StampGate::pass(const std::string& topic, SensorTime stamp, Duration arrived, bool leads) {
  if (stamp <= SensorTime{}) return fail(ErrorCode::Unreadable, "it has no stamp", {.key = topic});
  const Duration offset = arrived - stamp.time_since_epoch();
  if (!offset_ && !leads)
    return fail(ErrorCode::Unreadable, "it arrived before the first odometry", {.key = topic});
  if (!offset_) offset_ = offset;
  const Duration late = offset - *offset_;
  if (std::chrono::abs(late) > kMaxDeviation) return tl::unexpected(refused(topic, offset, arrived, leads));
  auto& newest = newest_.try_emplace(topic, stamp).first->second;
  if (stamp < newest)
    return fail(ErrorCode::Unreadable,
                fmt::format("its stamp went back by {:.3f} s", to_seconds(newest - stamp)), {.key = topic},
                "Check whether another node publishes on this topic.");
  newest = stamp;
  if (!leads) return {};
  *offset_ += late / kMean;
  other_.reset();
  return {};
}

}  // namespace waymark
