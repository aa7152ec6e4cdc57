#include "python/bindings/values.hpp"

#include <pybind11/stl.h>

#include "waymark/base/suggest.hpp"

namespace waymark::python {
void finish_value(const py::object& cls, const std::vector<std::string>& names) {
  const py::module_ shared = py::module_::import("waymark._same");
  py::setattr(cls, "_fields", py::tuple(py::cast(names)));
  py::setattr(cls, "__repr__", shared.attr("repr_of"));
  py::setattr(cls, "__eq__", shared.attr("equals"));
  py::setattr(cls, "__reduce__", shared.attr("reduce"));
  py::setattr(cls, "__hash__", py::none());
}

void finish_state(const py::object& cls) {
  py::setattr(cls, "__eq__", py::module_::import("waymark._same").attr("equals_by_state"));
  py::setattr(cls, "__hash__", py::none());
}

void set_attributes(const py::object& self, const py::object& cls, const py::kwargs& given) {
  const py::tuple names = cls.attr("_fields");
  for (const auto& [name, value] : given) {
    if (!names.contains(name))
      throw py::type_error(std::string(py::str(cls.attr("__name__"))) + " has no '" +
                           std::string(py::str(name)) + "'. " +
                           suggestion(std::string(py::str(name)), py::cast<std::vector<std::string>>(names)));
    py::setattr(self, name, value);
  }
}

}  // namespace waymark::python
