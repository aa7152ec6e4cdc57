#include "waymark/robots/ros2/other_drivers.hpp"

#include <fmt/format.h>

#include "waymark/robots/dds/ros_names.hpp"
#include "waymark/robots/process/sender_watch.hpp"

namespace waymark {

bool OtherDrivers::hear(const Guid& from, bool drives, const Bus& bus) {
  if (from == own_) return false;
  if (drives && !publishers_of(commands_, bus).contains(from)) {
    own_ = from;
    return false;
  }
  commanders_.insert(from);
  while_driving_ += drives ? 1 : 0;
  return true;
}

Result<std::string> OtherDrivers::found(const PublisherNames& names, const Bus& bus, Duration driving) const {
  constexpr Duration kBeginsToo = std::chrono::seconds(3);
  if (while_driving_ < kCommandsOfADriver) return std::string();
  const std::string who = names.of(commanders_, bus);
  const std::string words =
      fmt::format("another program commands this robot{}", who.empty() ? "" : ", " + who);
  if (driving >= kBeginsToo) return words + ": the robot obeys both in turn. End one of them";
  const auto topic = ros_topic(commands_);
  return fail(ErrorCode::InvalidArgument, words + ": both began at the same time",
              {.source = topic ? topic->topic : commands_.topic}, "Start one of them alone.");
}

}  // namespace waymark
