#include "waymark/recording/ros_definition.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

namespace waymark::ros {
namespace {

struct Name {
  std::string_view text;
  Primitive type;
};
constexpr std::array kPrimitives = {
    Name{"bool", Primitive::Bool}, Name{"int8", Primitive::Int8}, Name{"uint8", Primitive::UInt8},
    Name{"int16", Primitive::Int16}, Name{"uint16", Primitive::UInt16}, Name{"int32", Primitive::Int32},
    Name{"uint32", Primitive::UInt32}, Name{"int64", Primitive::Int64}, Name{"uint64", Primitive::UInt64},
    Name{"float32", Primitive::Float32}, Name{"float64", Primitive::Float64},
    Name{"string", Primitive::String}, Name{"time", Primitive::Time}, Name{"duration", Primitive::Duration},
    // Legacy names: "byte" is signed in ROS 1 and unsigned in ROS 2; the bits are the same.
    Name{"byte", Primitive::Int8}, Name{"char", Primitive::UInt8}};

constexpr std::size_t kMaxStructs = 1000;
constexpr std::size_t kMaxFields = 100'000;
constexpr std::uint32_t kMaxFixedCount = 1U << 24;

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view next_word(std::string_view& text) {
  text = trimmed(text);
  const std::string_view word = text.substr(0, text.find_first_of(" \t"));
  text.remove_prefix(word.size());
  return word;
}

/// The text for one type, before its fields are resolved.
struct Section {
  std::string name;
  std::string_view text;
  std::int64_t first_line = 1;
};

std::vector<Section> split_sections(std::string_view type, std::string_view text) {
  std::vector<Section> sections = {{short_type(type), {}, 1}};
  std::size_t begin = 0;
  std::int64_t line_number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view line = trimmed(text.substr(at, end - at));
    ++line_number;
    const bool rule = line.size() >= 20 && line.find_first_not_of('=') == std::string_view::npos;
    const bool named = line.starts_with("MSG: ");
    if (rule || named) {
      if (sections.back().text.empty()) sections.back().text = text.substr(begin, at - begin);
      begin = std::min(end + 1, text.size());
    }
    if (named) sections.push_back({short_type(trimmed(line.substr(5))), {}, line_number + 1});
    at = end + 1;
  }
  if (sections.back().text.empty()) sections.back().text = text.substr(std::min(begin, text.size()));
  return sections;
}

class Parser {
 public:
  explicit Parser(std::vector<Section> sections) : sections_(std::move(sections)) {}

  Result<Definition> run() {
    Result<std::size_t> root = structure(0);
    if (!root) return tl::unexpected(root.error());
    return std::move(definition_);
  }

 private:
  /// Index of a type among the structs; the type is parsed on first use.
  Result<std::size_t> structure(std::size_t section) {
    constexpr auto kInWork = static_cast<std::size_t>(-1);
    if (const auto known = done_.find(section); known != done_.end()) {
      if (known->second == kInWork)
        return wrong(section, 0, fmt::format("recursive type {}", sections_[section].name));
      return known->second;
    }
    if (done_.size() >= kMaxStructs || done_.size() > kMaxDepth)
      return wrong(section, 0, "too many types in the definition");
    done_[section] = kInWork;
    const std::size_t number = definition_.structs.size();
    definition_.structs.emplace_back();
    Struct parsed{.name = sections_[section].name};
    std::string_view text = sections_[section].text;
    for (std::int64_t line = 0; !text.empty(); ++line) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      if (Status status = parse_line(section, line, text.substr(0, end), parsed); !status)
        return tl::unexpected(status.error());
      text.remove_prefix(std::min(end + 1, text.size()));
    }
    drop_sequence_number(parsed);
    definition_.structs[number] = std::move(parsed);
    done_[section] = number;
    return number;
  }

  static void drop_sequence_number(Struct& parsed) {
    const bool header = parsed.name == "std_msgs/Header" && parsed.fields.size() == 3 &&
                        parsed.fields[0].name == "seq" && parsed.fields[0].type == Primitive::UInt32;
    parsed.has_sequence_number = header;
  }

  Status parse_line(std::size_t section, std::int64_t line, std::string_view text, Struct& into) {
    const std::string_view whole = text;
    std::string_view code = trimmed(text.substr(0, text.find('#')));
    if (code.empty() || code.front() == '=') return {};
    const std::string_view type = next_word(code);
    code = trimmed(code);
    const std::size_t name_end = std::min(code.find_first_of(" \t="), code.size());
    const std::string_view name = code.substr(0, name_end);
    if (name.empty())
      return wrong(section, line, fmt::format("field without a name: '{}'", printable(whole)));
    const std::string_view rest = trimmed(code.substr(name_end));
    if (rest.starts_with('=')) {
      // The value of a string constant is the rest of the line, including '#'.
      const bool text_constant = type == "string" || type == "wstring";
      const std::string_view value = text_constant ? whole.substr(whole.find('=') + 1) : rest.substr(1);
      into.constants.push_back({std::string(type), std::string(name), std::string(trimmed(value))});
      return {};
    }
    return add_field(section, line, type, name, into);
  }

  Status add_field(std::size_t section, std::int64_t line, std::string_view type, std::string_view name,
                   Struct& into) {
    if (++fields_ > kMaxFields) return wrong(section, line, "too many fields in the definition");
    Field field{.name = std::string(name)};
    if (const std::size_t bracket = type.find('['); bracket != std::string_view::npos) {
      std::string_view inside = type.substr(bracket + 1);
      if (!inside.ends_with(']'))
        return wrong(section, line, fmt::format("missing ']' in '{}'", printable(type)));
      inside.remove_suffix(1);
      field.repeat = inside.empty() || inside.starts_with("<=") ? Repeat::Sequence : Repeat::Fixed;
      if (field.repeat == Repeat::Fixed) {
        const auto [end, error] = std::from_chars(inside.data(), inside.data() + inside.size(), field.count);
        if (error != std::errc() || end != inside.data() + inside.size() || field.count > kMaxFixedCount)
          return wrong(section, line, fmt::format("invalid array size '{}'", printable(inside)));
      }
      type = type.substr(0, bracket);
    }
    if (const std::size_t bound = type.find("<="); bound != std::string_view::npos)
      type = type.substr(0, bound);
    const auto primitive = std::ranges::find(kPrimitives, type, &Name::text);
    if (primitive != kPrimitives.end()) {
      field.type = primitive->type;
    } else {
      const std::optional<std::size_t> used = find_section(type, sections_[section].name);
      if (!used) return wrong(section, line, fmt::format("undefined type '{}'", printable(type)));
      Result<std::size_t> number = structure(*used);
      if (!number) return tl::unexpected(number.error());
      field.type = Primitive::Struct;
      field.structure = *number;
    }
    into.fields.push_back(std::move(field));
    return {};
  }

  /// A name without a package is from the same package; "Header" is std_msgs/Header.
  [[nodiscard]] std::optional<std::size_t> find_section(std::string_view type, std::string_view user) const {
    std::string wanted = short_type(type);
    if (wanted.find('/') == std::string::npos)
      wanted = wanted == "Header" ? "std_msgs/Header"
                                  : fmt::format("{}/{}", user.substr(0, user.find('/')), wanted);
    for (std::size_t i = 1; i < sections_.size(); ++i) {
      if (sections_[i].name == wanted) return i;
    }
    return std::nullopt;
  }

  [[nodiscard]] tl::unexpected<Error> wrong(std::size_t section, std::int64_t line, std::string why) const {
    return fail(ErrorCode::Unreadable, std::move(why),
                {.source = fmt::format("definition of {}", printable(sections_.front().name)),
                 .line = sections_[section].first_line + line});
  }
  static std::string printable(std::string_view text) {
    std::string out(text.substr(0, 60));
    std::ranges::replace_if(
        out, [](char c) { return c < ' ' || c > '~'; }, '?');
    return out;
  }

  static constexpr std::size_t kMaxDepth = 200;
  std::vector<Section> sections_;
  std::map<std::size_t, std::size_t> done_;
  std::size_t fields_ = 0;
  Definition definition_;
};

}  // namespace

Result<Definition> parse_definition(std::string_view type, std::string_view text) {
  return Parser(split_sections(type, text)).run();
}

std::size_t size_of(Primitive type) {
  constexpr std::array<std::size_t, 15> kSizes = {1, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8, 0, 0, 0, 0};
  return kSizes.at(static_cast<std::size_t>(type));
}

std::string short_type(std::string_view type) {
  const std::size_t first = type.find('/');
  const std::size_t last = type.rfind('/');
  if (first == last) return std::string(type);
  return fmt::format("{}/{}", type.substr(0, first), type.substr(last + 1));
}

std::string ros2_type(std::string_view type) {
  const std::string name = short_type(type);
  if (name == "tf/tfMessage") return "tf2_msgs/msg/TFMessage";
  const std::size_t slash = name.find('/');
  if (slash == std::string::npos) return name;
  return fmt::format("{}/msg/{}", name.substr(0, slash), name.substr(slash + 1));
}

namespace {

constexpr std::size_t kMaxLayout = 1 << 16;

/// Appends the layout of a struct: a digit for the size of a number, 's' for a string, brackets for arrays.
/// Returns false if the limit is exceeded.
bool add_layout(const Definition& definition, std::size_t structure, std::string& out) {
  const Struct& s = definition.structs[structure];
  if (s.fields.empty()) out += '1';  // CDR encodes an empty struct as one byte
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

/// A constant in ROS 2 syntax; empty if ROS 2 has no syntax for it.
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
