#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/config/yaml_tree.hpp"

namespace waymark {

namespace internal {

template <class T>
inline constexpr bool kIsVector = false;
template <class T>
inline constexpr bool kIsVector<std::vector<T>> = true;
template <class T>
inline constexpr bool kIsOptional = false;
template <class T>
inline constexpr bool kIsOptional<std::optional<T>> = true;
template <class T>
inline constexpr bool kNotReadable = false;

/// Fails if a number is outside its field's range.
[[nodiscard]] Status check_range(const YamlCursor& cursor, double value, const Field& field);

}  // namespace internal

/// Reads an option struct from a map. A missing key keeps its default. Unknown keys (with the nearest known
/// key), wrong types and numbers out of range are errors. Fields may be of type bool, integer, floating
/// point, std::string, another option struct, or std::vector or std::optional of these. Errors contain file,
/// line and dotted key.
template <HasFields Options>
[[nodiscard]] Result<Options> read_fields(const YamlCursor& cursor);

/// Updates existing options: a missing key keeps its value, also in nested structs. After a failure, some
/// values may already have been updated.
template <HasFields Options>
[[nodiscard]] Status update_fields(const YamlCursor& cursor, Options& options);

namespace internal {

template <class T>
Status read_value(const YamlCursor& cursor, const Field& field, T& value);

template <class T>
Status read_number(const YamlCursor& cursor, const Field& field, T& value) {
  if constexpr (std::is_floating_point_v<T>) {
    const auto number = cursor.number();
    if (!number) return tl::unexpected<Error>(number.error());
    value = static_cast<T>(*number);
  } else {
    constexpr auto kLow = static_cast<std::int64_t>(std::numeric_limits<T>::min());
    constexpr auto kHigh = sizeof(T) < 8 || std::is_signed_v<T>
                               ? static_cast<std::int64_t>(std::numeric_limits<T>::max())
                               : std::numeric_limits<std::int64_t>::max();
    const auto number = cursor.integer(kLow, kHigh);
    if (!number) return tl::unexpected<Error>(number.error());
    value = static_cast<T>(*number);
  }
  return check_range(cursor, static_cast<double>(value), field);
}

template <class T>
Status read_list(const YamlCursor& cursor, const Field& field, std::vector<T>& value) {
  if (!cursor.is_sequence())
    return cursor.fail_here(ErrorCode::InvalidArgument, "a list is needed", "Write `[a, b]`.");
  value.clear();
  for (const YamlCursor& item : cursor.children()) {
    T element{};
    if (Status status = read_value(item, field, element); !status) return status;
    value.push_back(std::move(element));
  }
  return {};
}

template <class T>
Status read_value(const YamlCursor& cursor, const Field& field, T& value) {
  const auto keep = [&](auto&& result) -> Status {
    if (!result) return tl::unexpected<Error>(result.error());
    value = *std::forward<decltype(result)>(result);
    return {};
  };
  if constexpr (HasFields<T>) {
    return update_fields(cursor, value);
  } else if constexpr (std::is_same_v<T, bool>) {
    return keep(cursor.boolean());
  } else if constexpr (std::is_arithmetic_v<T>) {
    return read_number(cursor, field, value);
  } else if constexpr (std::is_same_v<T, std::string>) {
    return keep(cursor.text());
  } else if constexpr (kIsVector<T>) {
    return read_list(cursor, field, value);
  } else if constexpr (kIsOptional<T>) {
    return read_value(cursor, field, value.emplace());
  } else {
    static_assert(kNotReadable<T>, "no YAML for this type of field");
  }
}

template <class T>
std::string write_value(const T& value, int indent);

}  // namespace internal

template <HasFields Options>
Status update_fields(const YamlCursor& cursor, Options& options) {
  Status status = cursor.check_keys(field_names<Options>());
  Options::fields(options, [&](auto& value, const Field& field) {
    const auto found = cursor.find(field.name);
    if (status && found) status = internal::read_value(*found, field, value);
  });
  return status;
}

template <HasFields Options>
Result<Options> read_fields(const YamlCursor& cursor) {
  Options options;
  if (Status status = update_fields(cursor, options); !status) return tl::unexpected<Error>(status.error());
  return options;
}

/// Reads the text of a whole document; `source` is its name in errors. An empty document gives the defaults.
template <HasFields Options>
[[nodiscard]] Result<Options> parse_fields(std::string_view text, const std::string& source) {
  const auto root = parse_yaml(text, source);
  if (!root) return tl::unexpected<Error>(root.error());
  return read_fields<Options>(YamlCursor(*root, source));
}

/// Writes the whole struct as YAML, one field per line. The text reads back as the same value. Each line is
/// indented by `indent` spaces. Empty std::optional fields are omitted. Numbers must be finite.
template <HasFields Options>
[[nodiscard]] std::string write_fields(const Options& options, int indent = 0) {
  std::string text;
  Options::fields(options, [&](const auto& value, const Field& field) {
    const std::string written = internal::write_value(value, indent + 2);
    if (!written.empty())
      text += std::string(static_cast<std::size_t>(indent), ' ') + std::string(field.name) + ":" + written;
  });
  return text;
}

namespace internal {

/// Writes an element of a list, or a plain value.
template <class T>
std::string write_plain(const T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    return value ? "true" : "false";
  } else if constexpr (std::is_floating_point_v<T>) {
    return yaml_number(static_cast<double>(value));
  } else if constexpr (std::is_arithmetic_v<T>) {
    return std::to_string(value);
  } else {
    return yaml_text(value);
  }
}

/// The text after "key:", including line ends.
template <class T>
std::string write_value(const T& value, int indent) {
  if constexpr (HasFields<T>) {
    const std::string inner = write_fields(value, indent);
    return inner.empty() ? "\n" : "\n" + inner;
  } else if constexpr (kIsOptional<T>) {
    return value ? write_value(*value, indent) : "";
  } else if constexpr (kIsVector<T>) {
    if constexpr (HasFields<typename T::value_type>) {
      std::string text = value.empty() ? " []\n" : "\n";
      for (const auto& element : value) {
        std::string item = write_fields(element, indent + 2);
        if (!item.empty()) item.at(static_cast<std::size_t>(indent)) = '-';
        text += item;
      }
      return text;
    } else {
      std::string text;
      for (const auto& element : value)
        text += (text.empty() ? "" : ", ") + write_plain<typename T::value_type>(element);
      return " [" + text + "]\n";
    }
  } else {
    return " " + write_plain(value) + "\n";
  }
}

}  // namespace internal
}  // namespace waymark
