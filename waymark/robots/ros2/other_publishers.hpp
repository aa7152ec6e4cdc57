#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// Names of publishers for use in messages: the node name if ROS nodes announce their endpoints
/// (ros_discovery_info), otherwise the name of the DDS participant.
class PublisherNames {
 public:
  /// Subscribes to ros_discovery_info.
  Status join(Bus& bus);
  /// Handles a message from that subscription; returns whether the message was from it.
  bool take(const BusMessage& message);
  /// Adds the nodes of a participant: rmw_dds_common/msg/ParticipantEntitiesInfo, with a Gid of 24 bytes (up
  /// to Humble) or 16 bytes. Any other bytes are ignored.
  void add(std::span<const std::uint8_t> cdr);

  /// A list without duplicates, such as "/teleop, waymark_robot (process 4711 on limo-7)"; empty if no name
  /// is known.
  [[nodiscard]] std::string of(const std::set<Guid>& publishers, const Bus& bus) const;

 private:
  std::optional<std::size_t> subscription_{};
  std::map<Guid, std::string> nodes_{};  ///< by publisher
};

/// The publishers of a topic that have been discovered in other programs.
[[nodiscard]] std::set<Guid> publishers_of(const BusTopic& topic, const Bus& bus);

/// Finds other programs that publish on a robot's command topic. Takes into account that the network also
/// delivers this program's own commands.
class OtherDrivers {
 public:
  explicit OtherDrivers(BusTopic commands) : commands_(std::move(commands)) {}

  /// To be called for each command received, with its publisher. `drives`: whether this program publishes
  /// commands, too. Returns whether the publisher belongs to another program.
  bool receive(const Guid& from, bool drives, const Bus& bus);
  /// The names of the other drivers; empty if unknown.
  [[nodiscard]] std::string names(const PublisherNames& names, const Bus& bus) const {
    return names.of(commanders_, bus);
  }
  /// Checks for other drivers after this program has been driving for the time `driving`. Returns a message,
  /// which is empty if there are none. Fails if both started at the same time, so that neither could detect
  /// the other beforehand.
  [[nodiscard]] Result<std::string> found(const PublisherNames& names, const Bus& bus,
                                          Duration driving) const;

 private:
  BusTopic commands_;
  std::set<Guid> commanders_{};
  std::optional<Guid> own_{};
  int while_driving_ = 0;
};

}  // namespace waymark
