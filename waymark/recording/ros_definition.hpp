#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"

/// Message definitions as text in ROS 1 bags and ROS 2 recordings: first the fields of the type itself, then
/// every type it uses. Each of the latter follows a line of '=' and "MSG: package/Type".
namespace waymark::ros {

/// Type of a field. `Time` and `Duration` are two 32-bit numbers and are built in only in ROS 1.
enum class Primitive : std::uint8_t {
  Bool,
  Int8,
  UInt8,
  Int16,
  UInt16,
  Int32,
  UInt32,
  Int64,
  UInt64,
  Float32,
  Float64,
  String,
  Time,
  Duration,
  Struct,
};

enum class Repeat : std::uint8_t { One, Fixed, Sequence };

struct Field {
  std::string name{};
  Primitive type = Primitive::UInt8;
  std::size_t structure = 0;  ///< index in Definition::structs, for Struct
  Repeat repeat = Repeat::One;
  std::uint32_t count = 1;  ///< number of elements if Fixed
};

struct Constant {
  std::string type{};
  std::string name{};
  std::string value{};
};

struct Struct {
  std::string name{};  ///< "geometry_msgs/Pose"
  std::vector<Field> fields{};
  std::vector<Constant> constants{};
  /// True for ROS 1's std_msgs/Header; ROS 2 dropped its sequence number.
  bool has_sequence_number = false;
};

/// A message type with all types it uses.
struct Definition {
  std::vector<Struct> structs{};  ///< the first is the message itself; not recursive
};

/// Parses a definition of the type "package/Type" (or "package/msg/Type"). Fails, reporting the line, if a
/// type is undefined or recursive or a line is invalid. O(text).
[[nodiscard]] Result<Definition> parse_definition(std::string_view type, std::string_view text);

/// The byte layout of a message in CDR without sequence numbers, as text. Two types with the same layout can
/// be decoded using either definition. Empty if the text would exceed the size limit.
[[nodiscard]] std::optional<std::string> wire_layout(const Definition& definition);

/// The definition in ROS 2 syntax: without sequence numbers, `builtin_interfaces/Time` for `time`.
[[nodiscard]] std::string ros2_text(const Definition& definition);

/// Size of a number in bytes; 0 for other types.
[[nodiscard]] std::size_t size_of(Primitive type);

/// Converts either spelling of a type to that of ROS 2: "geometry_msgs/msg/Pose". The type tf/tfMessage of
/// old bags becomes tf2_msgs/msg/TFMessage.
[[nodiscard]] std::string ros2_type(std::string_view type);
/// Converts either spelling to that used by ROS 1 and by schema texts: "geometry_msgs/Pose".
[[nodiscard]] std::string short_type(std::string_view type);

}  // namespace waymark::ros
