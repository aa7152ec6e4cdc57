#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark {

/// One field of an option struct, named once: YAML keys, command line flags, Python keywords and the
/// reference page are made from it. The name carries the unit where one is needed ("tag_size_m").
struct Field {
  std::string_view name;      ///< snake_case key; the flag is the same with dashes
  std::string_view sentence;  ///< what it does and when to touch it
  double min = -std::numeric_limits<double>::infinity();  ///< smallest allowed value, for numbers
  double max = std::numeric_limits<double>::infinity();   ///< largest allowed value, for numbers
};

/// An option struct lists its fields in one static function that works for const and mutable objects alike:
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

/// The error of a number outside the range of its field.
[[nodiscard]] tl::unexpected<Error> outside_range(double number, const Field& field);

/// Checks every number against its range; the first one outside (or NaN) is the error.
template <HasFields Options>
[[nodiscard]] Status check_ranges(const Options& options) {
  Status status;
  Options::fields(options, [&](const auto& value, const Field& field) {
    if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(value)>>) {
      const double number = static_cast<double>(value);
      const bool inside = number >= field.min && number <= field.max;
      if (status && !inside) {
        status = outside_range(number, field);
      }
    }
  });
  return status;
}

/// Calls `visit(value, field)` for all fields of a struct and of the structs in it, in order; `enter(field)`
/// before those of a struct in it and `leave()` after.
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

/// check_ranges() that also looks into the structs in a struct.
template <HasFields Options>
[[nodiscard]] Status check_leaf_ranges(const Options& options) {
  Status status = check_ranges(options);
  Options::fields(options, [&](const auto& value, const Field&) {
    if constexpr (HasFields<std::remove_cvref_t<decltype(value)>>)
      if (status) status = check_leaf_ranges(value);
  });
  return status;
}

/// A field of a job: a Field with what a command line needs beyond it. A job lists its fields as option
/// structs do; its flags are made from them, and their help says the sentence:
///
///     visit(self.output, JobField("output FILE", "Recording to write (.mcap)").required());
struct JobField : Field {
  /// `named`: the key, which is the flag with dashes, and what its value is called: "tag_size_m NUMBER";
  /// of a switch the key alone. A range is checked where both of its ends are given.
  constexpr JobField(std::string_view named, std::string_view what,
                     double least = -std::numeric_limits<double>::infinity(),
                     double most = std::numeric_limits<double>::infinity())
      : Field{named.substr(0, named.find(' ')), what, least, most},
        value_name(named.substr(name.size() + (name.size() < named.size() ? 1 : 0))) {}

  /// An input, not a flag: a word by itself, called as its value is ("RUN", or "RUN ...").
  [[nodiscard]] constexpr JobField input() const { return with(&JobField::is_input, true); }
  [[nodiscard]] constexpr JobField required() const { return with(&JobField::is_required, true); }
  /// Needed less: the short help leaves it out.
  [[nodiscard]] constexpr JobField less() const { return with(&JobField::is_less, true); }
  /// One of these words, between commas: "jpeg,raw".
  [[nodiscard]] constexpr JobField one_of(std::string_view all) const { return with(&JobField::words, all); }
  /// What is said to be usual, where that is not the value before anything is given, or where that is zero.
  [[nodiscard]] constexpr JobField usually(std::string_view text) const {
    return with(&JobField::usual, text);
  }
  /// Its value before anything is given says nothing, and is not shown.
  [[nodiscard]] constexpr JobField without_usual() const { return with(&JobField::has_no_usual, true); }
  /// In a group of that name, which the short help leaves out.
  [[nodiscard]] constexpr JobField grouped(std::string_view title) const {
    return with(&JobField::group, title);
  }
  /// Means nothing without these other fields, or not beside those: "limo,mbot".
  [[nodiscard]] constexpr JobField needs(std::string_view keys) const {
    return with(&JobField::needed, keys);
  }
  [[nodiscard]] constexpr JobField excludes(std::string_view keys) const {
    return with(&JobField::excluded, keys);
  }
  /// Another name for it.
  [[nodiscard]] constexpr JobField also(std::string_view other) const {
    return with(&JobField::alias, other);
  }
  /// A list that is given in one word, with commas between its parts.
  [[nodiscard]] constexpr JobField by_commas() const { return with(&JobField::has_commas, true); }
  /// A list of which each part is given by a flag of its own.
  [[nodiscard]] constexpr JobField repeated() const { return with(&JobField::is_repeated, true); }
  /// A list of so many parts.
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
  bool has_no_usual = false;
  bool has_commas = false;
  bool is_repeated = false;
  int count = 0;  ///< of the parts of a list; 0: any

 private:
  template <class Value>
  [[nodiscard]] constexpr JobField with(Value JobField::*member, const Value& given) const {
    JobField changed = *this;
    changed.*member = given;
    return changed;
  }
};

}  // namespace waymark
