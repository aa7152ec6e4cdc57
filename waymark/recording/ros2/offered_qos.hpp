#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

/// The QoS profiles that a topic's publishers offer, as rosbag2 stores them with the topic (YAML;
/// ros2/rosbag2, rosbag2_storage/qos.cpp). `ros2 bag play` uses them for its publishers.
namespace waymark {

/// Time limit in a policy; by default there is no limit.
struct QosTime {
  std::uint64_t sec = 9223372036;
  std::uint64_t nsec = 854775807;
};

/// Policies as rmw's numbers (ros2/rmw, types.h).
struct OfferedQos {
  int history = 1;  ///< 1 for keep last, 2 for keep all, 3 for unknown
  std::uint64_t depth = 10;
  int reliability = 1;  ///< 1 for reliable, 2 for best effort
  int durability = 2;   ///< 1 for transient local, 2 for volatile
  QosTime deadline{};
  QosTime lifespan{};
  int liveliness = 1;  ///< 1 for automatic, 3 for manual by topic
  QosTime lease{};
  bool avoid_ros_namespace_conventions = false;
};

/// Notation of the policies: rmw's numbers (up to Iron) or names (since Jazzy). No release can read the other
/// notation.
enum class QosNotation : std::uint8_t { Numbers, Names };

/// Reads profiles in either notation, in YAML block or flow style. Missing policies have their default
/// values; a text without profiles gives an empty list.
[[nodiscard]] std::vector<OfferedQos> parse_offered_qos(std::string_view yaml);

/// Writes a YAML sequence with every line indented by `indent` blanks; "[]\n" if empty. All nine policies are
/// written, because rosbag2 rejects a profile that lacks one.
[[nodiscard]] std::string to_yaml(const std::vector<OfferedQos>& profiles, QosNotation notation,
                                  std::size_t indent = 0);

}  // namespace waymark
