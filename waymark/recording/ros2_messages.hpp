#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/recording/ros2_geometry_messages.hpp"
#include "waymark/recording/ros2_sensor_messages.hpp"
#include "waymark/recording/ros2_tag_messages.hpp"

/// The ROS 2 messages we record, field by field as in their .msg files, with the genuine schema text that a
/// ROS 2 recording carries ("ros2msg" encoding: the definition, then each dependency behind a line of 80 '='
/// and "MSG: package/Type").
namespace waymark::ros2 {

struct KeyValue {
  std::string key{};
  std::string value{};
  WAYMARK_ROS2_FIELDS(self.key, self.value)
};

struct DiagnosticStatus {
  std::uint8_t level = 0;  ///< 0 ok, 1 warn, 2 error, 3 stale
  std::string name{};
  std::string message{};
  std::string hardware_id{};
  std::vector<KeyValue> values{};
  WAYMARK_ROS2_FIELDS(self.level, self.name, self.message, self.hardware_id, self.values)
};

struct DiagnosticArray {
  static constexpr std::string_view kType = "diagnostic_msgs/msg/DiagnosticArray";
  Header header{};
  std::vector<DiagnosticStatus> status{};
  WAYMARK_ROS2_FIELDS(self.header, self.status)
};

struct ColorRGBA {
  float r = 0, g = 0, b = 0, a = 0;
  WAYMARK_ROS2_FIELDS(self.r, self.g, self.b, self.a)
};

struct RosDuration {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  WAYMARK_ROS2_FIELDS(self.sec, self.nanosec)
};

struct UVCoordinate {
  float u = 0, v = 0;
  WAYMARK_ROS2_FIELDS(self.u, self.v)
};

struct MeshFile {
  std::string filename{};
  Bytes data{};
  WAYMARK_ROS2_FIELDS(self.filename, self.data)
};

/// A shape to draw (visualization_msgs/Marker as of Humble).
struct Marker {
  static constexpr std::int32_t kArrow = 0, kCube = 1, kSphere = 2, kLineStrip = 4, kLineList = 5,
                                kCubeList = 6, kText = 9;
  Header header{};
  std::string ns{};
  std::int32_t id = 0;
  std::int32_t type = kArrow;
  std::int32_t action = 0;  ///< 0 add or modify, 2 delete, 3 delete all
  Pose pose{};
  Vector3 scale{};  ///< [m]
  ColorRGBA color{};
  RosDuration lifetime{};  ///< zero: for ever
  bool frame_locked = false;
  std::vector<Point> points{};
  std::vector<ColorRGBA> colors{};
  std::string texture_resource{};
  CompressedImage texture{};
  std::vector<UVCoordinate> uv_coordinates{};
  std::string text{};
  std::string mesh_resource{};
  MeshFile mesh_file{};
  bool mesh_use_embedded_materials = false;
  WAYMARK_ROS2_FIELDS(self.header, self.ns, self.id, self.type, self.action, self.pose, self.scale,
                      self.color, self.lifetime, self.frame_locked, self.points, self.colors,
                      self.texture_resource, self.texture, self.uv_coordinates, self.text, self.mesh_resource,
                      self.mesh_file, self.mesh_use_embedded_materials)
};

struct MarkerArray {
  static constexpr std::string_view kType = "visualization_msgs/msg/MarkerArray";
  std::vector<Marker> markers{};
  WAYMARK_ROS2_FIELDS(self.markers)
};

/// The schema text of a type as a ROS 2 recording carries it; empty for a type that is not in this header.
[[nodiscard]] std::string schema_text(std::string_view type);

}  // namespace waymark::ros2
