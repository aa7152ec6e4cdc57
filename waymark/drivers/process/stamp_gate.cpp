#include "waymark/drivers/process/stamp_gate.hpp"

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr Duration kMostOff = std::chrono::seconds(1);  // longer no picture is under way
constexpr int kMean = 100;

}  // namespace

Status StampGate::pass(const std::string& topic, SensorTime stamp, Duration arrived, bool leads) {
  if (stamp <= SensorTime{}) return fail(ErrorCode::Unreadable, "it has no stamp", {.key = topic});
  const Duration offset = arrived - stamp.time_since_epoch();
  if (!offset_ && !leads) return fail(ErrorCode::Unreadable, "it came before the odometry", {.key = topic});
  if (!offset_) offset_ = offset;
  const Duration late = offset - *offset_;
  if (late > kMostOff || late < -kMostOff)
    return fail(ErrorCode::Unreadable,
                fmt::format("its stamp is {:.1f} s {} by the clock of the odometry",
                            std::abs(to_seconds(late)), late > Duration(0) ? "in the past" : "in the future"),
                {.key = topic}, "Synchronise the clocks of the robot's computers.");
  auto& newest = newest_.try_emplace(topic, stamp).first->second;
  if (stamp < newest)
    return fail(ErrorCode::Unreadable,
                fmt::format("its stamp went back by {:.3f} s", to_seconds(newest - stamp)), {.key = topic},
                "Does another node publish there?");
  newest = stamp;
  if (leads) *offset_ += late / kMean;
  return {};
}

}  // namespace waymark
