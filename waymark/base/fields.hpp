#pragma once

#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark {

/// One field of an option struct. YAML keys, command line flags, Python keywords and the reference page are
/// generated from it. The name ends in the unit, if it has one ("tag_size_m").
struct Field {
  std::string_view name;                                  ///< snake_case key; the flag uses dashes instead
  std::string_view sentence;                              ///< what it does and when to change it
  double min = -std::numeric_limits<double>::infinity();  ///< smallest allowed value, for numbers
  double max = std::numeric_limits<double>::infinity();   ///< largest allowed value, for numbers
};

/// An option struct lists its fields in one static function that accepts const and mutable objects:
///
///     template <class Self, class Visitor>
///     static void fields(Self& self, Visitor&& visit) {
///       visit(self.quad_decimate, Field{"quad_decimate", "Look for quads in an image this much smaller.", 1,
///       8});
///     }
template <class T>
concept HasFields = requires(T& self) { T::fields(self, [](auto&, const Field&) {}); };

/// The names of all fields, in order.
template <HasFields Options>
[[nodiscard]] std::vector<std::string> field_names() {
  Options options;
  std::vector<std::string> names;
  Options::fields(options, [&](auto&, const Field& field) { names.emplace_back(field.name); });
  return names;
}

/// The error for a number outside its field's range.
[[nodiscard]] tl::unexpected<Error> outside_range(double number, const Field& field);

/// Whether a field is a number that may be empty, because its default depends on other values.
template <class Value>
inline constexpr bool kIsOptionalNumber = false;
template <class Number>
inline constexpr bool kIsOptionalNumber<std::optional<Number>> =
    std::is_arithmetic_v<Number> && !std::is_same_v<Number, bool>;

/// Checks each number against its range. The error reports the first one that is out of range or NaN.
template <HasFields Options>
[[nodiscard]] Status check_ranges(const Options& options) {
  Status status;
  const auto check = [&](double number, const Field& field) {
    const bool inside = number >= field.min && number <= field.max;
    if (status && !inside) status = outside_range(number, field);
  };
  Options::fields(options, [&](const auto& value, const Field& field) {
    using Value = std::remove_cvref_t<decltype(value)>;
    if constexpr (std::is_arithmetic_v<Value>) {
      check(static_cast<double>(value), field);
    } else if constexpr (kIsOptionalNumber<Value>) {
      if (value) check(static_cast<double>(*value), field);
    }
  });
  return status;
}

/// Calls `visit(value, field)` for all fields of a struct and its nested structs, in order; calls
/// `enter(field)` before the fields of a nested struct and `leave()` after them.
template <HasFields Options, class Visit, class Enter, class Leave>
void visit_leaves(Options& options, const Visit& visit, const Enter& enter, const Leave& leave) {
  std::remove_const_t<Options>::fields(options, [&](auto& value, const Field& field) {
    if constexpr (HasFields<std::remove_cvref_t<decltype(value)>>) {
      enter(field);
      visit_leaves(value, visit, enter, leave);
      leave();
    } else {
      visit(value, field);
    }
  });
}

/// Like check_ranges(), and also checks nested structs.
template <HasFields Options>
[[nodiscard]] Status check_leaf_ranges(const Options& options) {
  Status status = check_ranges(options);
  Options::fields(options, [&](const auto& value, const Field&) {
    if constexpr (HasFields<std::remove_cvref_t<decltype(value)>>)
      if (status) status = check_leaf_ranges(value);
  });
  return status;
}

/// A field of a job: a Field with additional properties for a command line flag or argument. A job lists its
/// fields as an option struct does; flags and their help are generated from them:
///
///     visit(self.output, JobField("output FILE", "Recording to write (.mcap)").required());
struct JobField : Field {
  /// `named` is the key followed by the name of its value, such as "tag_size_m NUMBER"; a switch has only a
  /// key. The flag has dashes instead of underscores. The range is checked if both ends are given.
  constexpr JobField(std::string_view named, std::string_view what,
                     double least = -std::numeric_limits<double>::infinity(),
                     double most = std::numeric_limits<double>::infinity())
      : Field{named.substr(0, named.find(' ')), what, least, most},
        value_name(named.substr(name.size() + (name.size() < named.size() ? 1 : 0))) {}

  /// A positional argument instead of a flag, shown as the name of its value ("RUN", or "RUN ...").
  [[nodiscard]] constexpr JobField input() const { return with(&JobField::is_input, true); }
  [[nodiscard]] constexpr JobField required() const { return with(&JobField::is_required, true); }
  /// Rarely needed, so the short help omits it.
  [[nodiscard]] constexpr JobField less() const { return with(&JobField::is_less, true); }
  /// The value must be one of these comma-separated words: "jpeg,raw".
  [[nodiscard]] constexpr JobField one_of(std::string_view all) const { return with(&JobField::words, all); }
  /// The default shown in the help, if it differs from the initial value or if the initial value is zero.
  [[nodiscard]] constexpr JobField usually(std::string_view text) const {
    return with(&JobField::usual, text);
  }
  /// The help shows no default, because the initial value has no meaning.
  [[nodiscard]] constexpr JobField without_default() const { return with(&JobField::has_no_default, true); }
  /// Belongs to the group with this title, which the short help omits.
  [[nodiscard]] constexpr JobField grouped(std::string_view title) const {
    return with(&JobField::group, title);
  }
  /// Requires these other fields ("limo,mbot"); excludes() lists fields that must not be set as well.
  [[nodiscard]] constexpr JobField needs(std::string_view keys) const {
    return with(&JobField::needed, keys);
  }
  [[nodiscard]] constexpr JobField excludes(std::string_view keys) const {
    return with(&JobField::excluded, keys);
  }
  /// An alternative name.
  [[nodiscard]] constexpr JobField also(std::string_view other) const {
    return with(&JobField::alias, other);
  }
  /// A list written as one comma-separated word.
  [[nodiscard]] constexpr JobField comma_separated() const { return with(&JobField::has_commas, true); }
  /// A list; the flag is repeated for each element.
  [[nodiscard]] constexpr JobField repeated() const { return with(&JobField::is_repeated, true); }
  /// A list of exactly this many elements.
  [[nodiscard]] constexpr JobField parts(int number) const { return with(&JobField::count, number); }

  std::string_view value_name;
  std::string_view words = {};
  std::string_view usual = {};
  std::string_view group = {};
  std::string_view alias = {};
  std::string_view needed = {};
  std::string_view excluded = {};
  bool is_input = false;
  bool is_required = false;
  bool is_less = false;
  bool has_no_default = false;
  bool has_commas = false;
  bool is_repeated = false;
  int count = 0;  ///< number of elements in a list; 0 means any

 private:
  template <class Value>
  [[nodiscard]] constexpr JobField with(Value JobField::*member, const Value& given) const {
    JobField changed = *this;
    changed.*member = given;
    return changed;
  }
};

}  // namespace waymark
