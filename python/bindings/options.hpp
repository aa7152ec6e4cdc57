#pragma once

#include <string>
#include <utility>

#include <pybind11/pybind11.h>

#include "python/bindings/errors.hpp"
#include "waymark/config/yaml_fields.hpp"

namespace waymark::python {

/// Converts keyword arguments to the tree of a YAML file with the same keys. Supports None, bool, numbers,
/// strings, lists, and dictionaries whose keys are strings; raises InvalidArgument for anything else.
[[nodiscard]] YamlNode tree_of(const py::handle& value, const std::string& key = {});

/// Converts an error of the YAML reader for keyword arguments, for which only the key is meaningful as a
/// location.
[[nodiscard]] Error without_file(Error error);

/// Options by keyword, using the same table of fields as YAML and flags. An unknown keyword, a wrong type and
/// a number out of range raise InvalidArgument. Nested options are dictionaries.
template <HasFields Options>
void update_options(Options& options, const py::dict& given) {
  const YamlNode tree = tree_of(given);
  const Status status = update_fields(YamlCursor(tree, ""), options);
  if (!status) throw Raised(without_file(status.error()));
}

template <HasFields Options>
[[nodiscard]] Options options_of(const py::dict& given) {
  Options options;
  update_options(options, given);
  return options;
}

/// One line of help: "  name: sentence (default)".
void add_option_line(std::string& text, int indent, const Field& field, const std::string& usual);

/// The option fields for a docstring, one per line, with defaults and ranges.
template <HasFields Options>
[[nodiscard]] std::string options_help(int indent = 2) {
  std::string text;
  const Options options;
  Options::fields(options, [&](const auto& value, const Field& field) {
    using Value = std::remove_cvref_t<decltype(value)>;
    if constexpr (HasFields<Value>) {
      add_option_line(text, indent, field, " a dictionary of");
      text += options_help<Value>(indent + 2);
    } else {
      add_option_line(text, indent, field, waymark::internal::write_value(value, 0));
    }
  });
  return text;
}

/// Removes one keyword from the dictionary and returns it; None if it is missing or None.
[[nodiscard]] py::object take(py::dict& given, const char* name);

}  // namespace waymark::python
