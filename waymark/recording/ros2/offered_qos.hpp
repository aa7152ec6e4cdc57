#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

/// Qualities of service that the publishers of a topic offered, as rosbag2 keeps them beside the topic
/// (YAML; ros2/rosbag2, rosbag2_storage/qos.cpp). `ros2 bag play` offers the topic by them.
namespace waymark {

/// A time limit of a policy; the default is no limit.
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

/// How the policies are written: by rmw's numbers (up to Iron), or by their names (from Jazzy on). Either
/// release cannot read the other's.
enum class QosNotation : std::uint8_t { Numbers, Names };

/// Reads the profiles of either notation, in YAML's block or flow style. Policies that are missing are the
/// defaults; a text without profiles gives none.
[[nodiscard]] std::vector<OfferedQos> parse_offered_qos(std::string_view yaml);

/// A YAML sequence, every line after `indent` blanks; "[]\n" where there are none. All nine policies are
/// written: rosbag2 reads no profile that lacks one.
[[nodiscard]] std::string to_yaml(const std::vector<OfferedQos>& profiles, QosNotation notation,
                                  std::size_t indent = 0);

}  // namespace waymark
