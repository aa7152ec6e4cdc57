#pragma once

#include <string>
#include <utility>

#include <pybind11/pybind11.h>

#include "python/bindings/errors.hpp"
#include "waymark/config/yaml_fields.hpp"

namespace waymark::python {

/// Keyword arguments as the tree that a YAML file with the same keys gives: None, bool, numbers, strings,
/// lists and dictionaries, whose keys are strings. Raises InvalidArgument for anything else.
[[nodiscard]] YamlNode tree_of(const py::handle& value, const std::string& key = {});

/// The error of a reader of YAML, for somebody who gave keyword arguments: only the key says where.
[[nodiscard]] Error without_file(Error error);

/// Options by keyword, from the same table of fields as YAML and flags: an unknown keyword, a wrong type and
/// a number out of range raise InvalidArgument. Options in options are dictionaries.
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

/// The fields of options for a docstring, one a line, with their defaults and ranges.
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

/// Takes one keyword out of the dictionary; nothing when it is not there or None.
[[nodiscard]] py::object take(py::dict& given, const char* name);

}  // namespace waymark::python
