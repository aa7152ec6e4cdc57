#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// Names of publishers, for words to people: of the node where the nodes of a ROS release say what they have
/// (ros_discovery_info), else of the program as DDS knows it.
class PublisherNames {
 public:
  /// Subscribes to what nodes say of themselves.
  Status join(Bus& bus);
  /// Whether the message was of that subscription, and is dealt with.
  bool take(const BusMessage& message);
  /// What a participant says of its nodes: rmw_dds_common/msg/ParticipantEntitiesInfo, with identities of 24
  /// bytes (up to Humble) or of 16. What is neither says nothing.
  void add(std::span<const std::uint8_t> cdr);

  /// "/teleop", "waymark_robot (process 4711 on limo-7)"; each once; empty where nobody tells.
  [[nodiscard]] std::string of(const std::set<Guid>& publishers, const Bus& bus) const;

 private:
  std::optional<std::size_t> subscription_{};
  std::map<Guid, std::string> nodes_{};  ///< by publisher
};

/// The publishers of a topic that are not this program's, as far as they were discovered.
[[nodiscard]] std::set<Guid> publishers_of(const BusTopic& topic, const Bus& bus);

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
