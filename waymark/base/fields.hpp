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

}  // namespace waymark
