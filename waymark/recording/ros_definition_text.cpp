#include <algorithm>
#include <array>
#include <cctype>
#include <functional>
#include <set>

#include <fmt/format.h>

#include "waymark/recording/ros_definition.hpp"

namespace waymark::ros {
namespace {

constexpr std::size_t kMaxLayout = 1 << 16;

/// Appends the layout of a struct: a digit for a number of so many bytes, 's' for text, brackets for arrays.
/// False when it grows too long.
bool add_layout(const Definition& definition, std::size_t structure, std::string& out) {
  const Struct& s = definition.structs[structure];
  if (s.fields.empty()) out += '1';  // CDR knows no empty struct: one byte stands for it
  for (std::size_t i = s.has_sequence_number ? 1 : 0; i < s.fields.size(); ++i) {
    const Field& field = s.fields[i];
    if (out.size() > kMaxLayout) return false;
    if (field.repeat != Repeat::One) out += '(';
    if (field.type == Primitive::Struct) {
      if (!add_layout(definition, field.structure, out)) return false;
    } else if (field.type == Primitive::Time || field.type == Primitive::Duration) {
      out += "44";
    } else {
      out += field.type == Primitive::String ? 's' : static_cast<char>('0' + size_of(field.type));
    }
    if (field.repeat == Repeat::Fixed) out += fmt::format(")[{}]", field.count);
    if (field.repeat == Repeat::Sequence) out += ")*";
  }
  return true;
}

std::string type_text(const Definition& definition, const Field& field) {
  constexpr std::array<const char*, 14> kNames = {"bool",
                                                  "int8",
                                                  "uint8",
                                                  "int16",
                                                  "uint16",
                                                  "int32",
                                                  "uint32",
                                                  "int64",
                                                  "uint64",
                                                  "float32",
                                                  "float64",
                                                  "string",
                                                  "builtin_interfaces/Time",
                                                  "builtin_interfaces/Duration"};
  std::string text = field.type == Primitive::Struct ? definition.structs[field.structure].name
                                                     : kNames.at(static_cast<std::size_t>(field.type));
  if (field.repeat == Repeat::Fixed) text += fmt::format("[{}]", field.count);
  if (field.repeat == Repeat::Sequence) text += "[]";
  return text;
}

/// A constant as ROS 2 writes it; empty for one it could not read.
std::string constant_text(const Constant& constant) {
  if (constant.type == "string" || constant.type == "wstring") {
    const bool plain =
        std::ranges::none_of(constant.value, [](char c) { return c == '"' || c == '\\' || c < ' '; });
    const bool quoted = constant.value.starts_with('"') || constant.value.starts_with('\'');
    if (quoted) return fmt::format("string {}={}\n", constant.name, constant.value);
    return plain ? fmt::format("string {}=\"{}\"\n", constant.name, constant.value) : "";
  }
  const bool number = !constant.value.empty() && std::ranges::all_of(constant.value, [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '+' || c == '.';
  });
  return number ? fmt::format("{} {}={}\n", constant.type, constant.name, constant.value) : "";
}

std::string struct_text(const Definition& definition, const Struct& s) {
  std::string text;
  for (const Constant& constant : s.constants) text += constant_text(constant);
  for (std::size_t i = s.has_sequence_number ? 1 : 0; i < s.fields.size(); ++i)
    text += fmt::format("{} {}\n", type_text(definition, s.fields[i]), s.fields[i].name);
  return text;
}

}  // namespace

std::optional<std::string> wire_layout(const Definition& definition) {
  std::string layout;
  if (!add_layout(definition, 0, layout)) return std::nullopt;
  return layout;
}

std::string ros2_text(const Definition& definition) {
  std::string text = struct_text(definition, definition.structs.front());
  const auto add_section = [&text](std::string_view name, std::string_view fields) {
    text += fmt::format("{:=<80}\nMSG: {}\n{}", "", name, fields);
  };
  bool time = false;
  bool duration = false;
  std::set<std::string> written;
  for (std::size_t i = 0; i < definition.structs.size(); ++i) {
    const Struct& s = definition.structs[i];
    if (i > 0 && written.insert(s.name).second) add_section(s.name, struct_text(definition, s));
    for (const Field& field : s.fields) {
      time = time || field.type == Primitive::Time;
      duration = duration || field.type == Primitive::Duration;
    }
  }
  if (time) add_section("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
  if (duration) add_section("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n");
  return text;
}

}  // namespace waymark::ros
