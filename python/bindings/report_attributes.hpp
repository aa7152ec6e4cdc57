#pragma once

#include <string>

#include <pybind11/pybind11.h>

#include "waymark/app/common/report_fields.hpp"

namespace waymark::python {

namespace py = pybind11;

/// A report value as returned by json.loads(): None (also for non-finite numbers), bool, int, float, str,
/// list or dict.
[[nodiscard]] py::object to_python(const ReportValue& value);
/// A dictionary with the keys printed by `--json`, in the same order.
[[nodiscard]] py::dict to_python(const ReportFields& fields);
/// The value of one key; None if the report does not contain it.
[[nodiscard]] py::object value_of_key(const ReportFields& fields, const std::string& key);

/// Adds a read-only attribute for each key of `--json` that the report class does not define.
/// Call it after defining the attributes of the class.
template <IsReport Report>
void def_report_attributes(py::class_<Report>& cls) {
  for (const ReportField& field : fields(Report{})) {
    if (py::hasattr(cls, field.name.c_str())) continue;
    cls.def_property_readonly(
        field.name.c_str(),
        [key = field.name](const Report& report) { return value_of_key(fields(report), key); },
        std::string(field.sentence).c_str());
  }
}

}  // namespace waymark::python
