#include "python/bindings/report_attributes.hpp"

#include <algorithm>
#include <cmath>
#include <concepts>
#include <type_traits>
#include <variant>

namespace waymark::python {
namespace {

/// Bytes that are not UTF-8 (file names) become U+FFFD, as in the output of `--json`.
py::str text_of(const std::string& text) {
  PyObject* decoded = PyUnicode_DecodeUTF8(text.data(), static_cast<py::ssize_t>(text.size()), "replace");
  if (decoded == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::str>(decoded);
}

}  // namespace

py::object to_python(const ReportValue& value) {
  return std::visit(
      [](const auto& content) -> py::object {
        using T = std::remove_cvref_t<decltype(content)>;
        if constexpr (std::same_as<T, std::monostate>) {
          return py::none();
        } else if constexpr (std::same_as<T, double>) {
          return std::isfinite(content) ? py::object(py::float_(content)) : py::object(py::none());
        } else if constexpr (std::same_as<T, std::string>) {
          return text_of(content);
        } else if constexpr (std::same_as<T, ReportValue::List>) {
          py::list list;
          for (const ReportValue& item : content) list.append(to_python(item));
          return list;
        } else if constexpr (std::same_as<T, ReportFields>) {
          return to_python(content);
        } else {
          return py::cast(content);
        }
      },
      value.content());
}

py::dict to_python(const ReportFields& fields) {
  py::dict all;
  for (const ReportField& field : fields)
    if (!field.value.is_left_out()) all[text_of(field.name)] = to_python(field.value);
  return all;
}

py::object value_of_key(const ReportFields& fields, const std::string& key) {
  const auto field = std::ranges::find(fields, key, &ReportField::name);
  return field == fields.end() || field->value.is_left_out() ? py::none() : to_python(field->value);
}

}  // namespace waymark::python
