#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "waymark/robots/dds/bus.hpp"

namespace waymark {

/// Names of publishers for messages: the node name if ROS nodes announce their endpoints
/// (ros_discovery_info), otherwise the name of the DDS participant.
class PublisherNames {
 public:
  /// Subscribes to ros_discovery_info.
  Status join(Bus& bus);
  /// Handles a message of that subscription; returns whether it was one.
  bool take(const BusMessage& message);
  /// Adds the nodes of a participant: rmw_dds_common/msg/ParticipantEntitiesInfo, with a Gid of 24 bytes (up
  /// to Humble) or of 16. Other bytes are ignored.
  void add(std::span<const std::uint8_t> cdr);

  /// A list without duplicates: "/teleop, waymark_robot (process 4711 on limo-7)"; empty if no name is known.
  [[nodiscard]] std::string of(const std::set<Guid>& publishers, const Bus& bus) const;

 private:
  std::optional<std::size_t> subscription_{};
  std::map<Guid, std::string> nodes_{};  ///< by publisher
};

/// The discovered publishers of a topic in other programs.
[[nodiscard]] std::set<Guid> publishers_of(const BusTopic& topic, const Bus& bus);

/// Finds other programs that publish on a robot's command topic. Takes into account that the network also
/// delivers this program's commands.
class OtherDrivers {
 public:
  explicit OtherDrivers(BusTopic commands) : commands_(std::move(commands)) {}

  /// Call for each received command, with its publisher. `drives`: this program publishes commands, too.
  /// Returns whether the publisher belongs to another program.
  bool receive(const Guid& from, bool drives, const Bus& bus);
  /// The names of the other drivers; empty if unknown.
  [[nodiscard]] std::string names(const PublisherNames& names, const Bus& bus) const {
    return names.of(commanders_, bus);
  }
  /// Checks for other drivers after this program has been driving for `driving`. Returns a message, empty if
  /// none were found. Fails if both started at the same time, so that neither could detect the other before.
  [[nodiscard]] Result<std::string> found(const PublisherNames& names, const Bus& bus,
                                          Duration driving) const;

 private:
  BusTopic commands_;
  std::set<Guid> commanders_{};
  std::optional<Guid> own_{};
  int while_driving_ = 0;
};

}  // namespace waymark
