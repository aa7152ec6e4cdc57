#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"

/// Message definitions as text, as ROS 1 bags and ROS 2 recordings carry them: the fields of the type itself,
/// then every type it uses behind a line of '=' and "MSG: package/Type".
namespace waymark::ros {

/// What a field is made of. `Time` and `Duration` are two 32-bit numbers and only ROS 1 has them built in.
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
  std::size_t structure = 0;  ///< which of Definition::structs, for Struct
  Repeat repeat = Repeat::One;
  std::uint32_t count = 1;  ///< of Fixed
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
  /// ROS 1's std_msgs/Header, whose sequence number ROS 2 no longer has.
  bool has_sequence_number = false;
};

/// A message type with all it uses.
struct Definition {
  std::vector<Struct> structs{};  ///< the first one is the message; none uses itself
};

/// Parses a definition of the type "package/Type" (or "package/msg/Type"). Fails, naming the line, on a type
/// that is not defined, that uses itself, or a line that makes no sense. O(text).
[[nodiscard]] Result<Definition> parse_definition(std::string_view type, std::string_view text);

/// The order of bytes a message has in CDR once sequence numbers are dropped, as text: two types with the
/// same layout can be decoded by each other's definition. Nothing when it would be absurdly long.
[[nodiscard]] std::optional<std::string> wire_layout(const Definition& definition);

/// The same definition as ROS 2 writes it: without sequence numbers, `builtin_interfaces/Time` for `time`.
[[nodiscard]] std::string ros2_text(const Definition& definition);

/// Size of a number [byte]; 0 for what is none.
[[nodiscard]] std::size_t size_of(Primitive type);

/// "geometry_msgs/Pose" of either spelling to that of ROS 2: "geometry_msgs/msg/Pose".
[[nodiscard]] std::string ros2_type(std::string_view type);
/// … and of ROS 1 and schema texts: "geometry_msgs/Pose".
[[nodiscard]] std::string short_type(std::string_view type);

}  // namespace waymark::ros
