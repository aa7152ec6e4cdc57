#pragma once

#include <concepts>
#include <cstdint>
#include <functional>
#include <optional>
#include <ranges>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/base/error.hpp"

/// Lists the content of a report in a single place. `--json`, the keys in `--help-all` and
/// docs/reference/cli.md, and the attributes in Python are generated from it. A report is a plain struct with
/// a free function:
///
///     ReportFields fields(const TeachReport& report) {
///       return {{"file", "Recording that was written", report.file},
///               {"lap_s", "Duration of the lap in the world", report.lap_s},
///               {"weak_links", "One entry per link: tags connected by few frames", report.weak_links}};
///     }
namespace waymark {

struct ReportField;
using ReportFields = std::vector<ReportField>;

/// A type for which fields() is defined.
template <class T>
concept IsReport = requires(const T& report) {
  { fields(report) } -> std::same_as<ReportFields>;
};

/// A value in a report: a number, a bool, a text, or another report. An optional becomes null if it is empty,
/// a range becomes a list, and ReportFields becomes an object whose keys depend on the data. The type and the
/// keys of nested reports are kept even for an empty list or a null value.
class ReportValue {
 public:
  using List = std::vector<ReportValue>;
  using Content = std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string, List,
                               ReportFields>;

  ReportValue();
  ReportValue(const ReportValue& other);
  ReportValue(ReportValue&& other) noexcept;
  ReportValue& operator=(const ReportValue& other);
  ReportValue& operator=(ReportValue&& other) noexcept;
  ~ReportValue();
  template <class T>
    requires(!std::same_as<T, ReportValue>)
  ReportValue(const T& given);  // NOLINT(google-explicit-constructor): tables of fields() read as tables

  [[nodiscard]] const Content& content() const { return content_; }
  /// Returns "number", "integer", "text", "bool", "object" or "list"; "value" if unknown.
  [[nodiscard]] std::string_view type() const { return type_; }
  [[nodiscard]] bool may_be_null() const { return may_be_null_; }
  /// Whether it is omitted from the output because it has no value; the reference still lists it.
  [[nodiscard]] bool is_left_out() const { return is_left_out_; }
  /// The keys of this object, or of the objects in this list; empty for other types.
  [[nodiscard]] ReportFields keys() const;

 private:
  template <class T>
  friend ReportValue if_any(const std::optional<T>& value);

  Content content_;
  std::string_view type_ = "value";
  bool may_be_null_ = false;
  bool is_left_out_ = false;
  ReportFields keys_;  ///< used if the content does not include them
};

/// One key of a report.
struct ReportField {
  std::string name{};           ///< name including the unit, such as "lap_s"
  std::string_view sentence{};  ///< description; must have static storage duration
  ReportValue value{};
};

/// A key that is omitted if it has no value, whereas an optional in a table becomes null.
template <class T>
[[nodiscard]] ReportValue if_any(const std::optional<T>& value) {
  ReportValue made(value);
  made.may_be_null_ = false;
  made.is_left_out_ = !value.has_value();
  return made;
}

/// Accesses a member through an optional, as in part(report.scores, &Scores::rmse_m). The member may also be
/// a function.
template <class T, class Member>
[[nodiscard]] auto part(const std::optional<T>& whole, const Member& member) {
  using Part = std::remove_cvref_t<std::invoke_result_t<const Member&, const T&>>;
  return whole ? std::optional<Part>(std::invoke(member, *whole)) : std::nullopt;
}

/// Returns "code", "message" and, if known, "source", "line", "byte", "key", "hint".
[[nodiscard]] ReportFields fields(const Error& error);

/// Converts to an object with the keys in order. O(values).
[[nodiscard]] nlohmann::ordered_json to_json(const ReportFields& fields);
/// Converts to one line of JSON, including the newline. Bytes that are not valid UTF-8 (file names) become
/// U+FFFD.
[[nodiscard]] std::string json_line(const nlohmann::ordered_json& value);
[[nodiscard]] std::string json_line(const ReportFields& fields);
/// The same, spread over several lines for a file.
[[nodiscard]] std::string json_text(const ReportFields& fields);

namespace detail {

template <class T>
struct IsOptional : std::false_type {};
template <class T>
struct IsOptional<std::optional<T>> : std::true_type {};

}  // namespace detail

template <class T>
  requires(!std::same_as<T, ReportValue>)
ReportValue::ReportValue(const T& given) : ReportValue() {
  if constexpr (std::same_as<T, bool>) {
    content_ = given, type_ = "bool";
  } else if constexpr (std::signed_integral<T>) {
    content_ = std::int64_t{given}, type_ = "integer";
  } else if constexpr (std::unsigned_integral<T>) {
    content_ = std::uint64_t{given}, type_ = "integer";
  } else if constexpr (std::floating_point<T>) {
    content_ = double{given}, type_ = "number";
  } else if constexpr (std::convertible_to<T, std::string_view>) {
    content_ = std::string(std::string_view(given)), type_ = "text";
  } else if constexpr (detail::IsOptional<T>::value) {
    if (given) *this = ReportValue(*given);
    if (!given) {
      const ReportValue usual(typename T::value_type{});
      type_ = usual.type_;
      keys_ = usual.keys();
    }
    may_be_null_ = true;
  } else if constexpr (std::same_as<T, ReportFields>) {
    content_ = given, type_ = "object";
  } else if constexpr (IsReport<T>) {
    content_ = fields(given), type_ = "object";
  } else {
    using Item = std::ranges::range_value_t<const T>;
    List list;
    for (const auto& item : given) list.emplace_back(static_cast<const Item&>(item));
    if (list.empty() && std::is_default_constructible_v<Item>) keys_ = ReportValue(Item{}).keys();
    content_ = std::move(list), type_ = "list";
  }
}

}  // namespace waymark
