#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

/// QoS profiles offered by the publishers of a topic, as rosbag2 stores them with the topic (YAML;
/// ros2/rosbag2, rosbag2_storage/qos.cpp). `ros2 bag play` uses them for its publishers.
namespace waymark {

/// Time limit of a policy; the default is no limit.
struct QosTime {
  std::uint64_t sec = 9223372036;
  std::uint64_t nsec = 854775807;
};

/// Policies by rmw's numbers (ros2/rmw, types.h).
struct OfferedQos {
  int history = 1;  ///< 1 keep last, 2 keep all, 3 unknown
  std::uint64_t depth = 10;
  int reliability = 1;  ///< 1 reliable, 2 best effort
  int durability = 2;   ///< 1 transient local, 2 volatile
  QosTime deadline{};
  QosTime lifespan{};
  int liveliness = 1;  ///< 1 automatic, 3 manual by topic
  QosTime lease{};
  bool avoid_ros_namespace_conventions = false;
};

/// Notation of the policies: rmw's numbers (up to Iron) or names (from Jazzy on). Releases cannot read the
/// other notation.
enum class QosNotation : std::uint8_t { Numbers, Names };

/// Reads profiles in either notation, in YAML block or flow style. Missing policies have their defaults; a
/// text without profiles gives an empty list.
[[nodiscard]] std::vector<OfferedQos> parse_offered_qos(std::string_view yaml);

/// Writes a YAML sequence, every line indented by `indent` blanks; "[]\n" if empty. All nine policies are
/// written, because rosbag2 rejects a profile that lacks one.
[[nodiscard]] std::string to_yaml(const std::vector<OfferedQos>& profiles, QosNotation notation,
                                  std::size_t indent = 0);

}  // namespace waymark
