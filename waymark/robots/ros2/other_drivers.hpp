#pragma once

#include <optional>
#include <set>
#include <string>

#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/ros2/publisher_names.hpp"

namespace waymark {

/// Who else publishes commands on the topic that a robot is driven by. Ours come back from the network, too.
class OtherDrivers {
 public:
  explicit OtherDrivers(BusTopic commands) : commands_(std::move(commands)) {}

  /// A command of this publisher came. `drives`: this program publishes commands, too. Whether it is
  /// another's.
  bool hear(const Guid& from, bool drives, const Bus& bus);
  /// Their names; empty where nobody tells.
  [[nodiscard]] std::string names(const PublisherNames& names, const Bus& bus) const {
    return names.of(commanders_, bus);
  }
  /// That others command the robot while this program drives it for so long: fails where both began at the
  /// same time, so that neither heard the other beforehand; else in words, empty where nobody does.
  [[nodiscard]] Result<std::string> found(const PublisherNames& names, const Bus& bus,
                                          Duration driving) const;

 private:
  BusTopic commands_;
  std::set<Guid> commanders_{};
  std::optional<Guid> own_{};
  int while_driving_ = 0;
};

}  // namespace waymark
