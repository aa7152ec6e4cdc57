#include "python/bindings/values.hpp"

#include <pybind11/stl.h>

#include "python/bindings/errors.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark::python {
namespace {

/// pybind11 calls this to allocate memory if an argument is an object without a value, and would then read
/// uninitialised memory.
void* refuse_memory(std::size_t /*size*/) {
  throw py::type_error(
      "an object without a value: its __init__() was not called. Create objects by calling their class, such "
      "as SE3()");
}

}  // namespace

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

void refuse_pickle(const py::object& cls, const std::string& reason) {
  py::setattr(cls, "__reduce__",
              py::cpp_function(
                  [reason](const py::object& self) -> py::object {
                    throw py::type_error(with_article(py::str(py::type::of(self).attr("__name__"))) +
                                         " can be neither pickled nor copied: " + reason);
                  },
                  py::is_method(cls), py::name("__reduce__")));
}

void pickle_by_protocol_2(const py::module_& room) {
  const py::object reduce = py::module_::import("waymark._same").attr("reduce_ex");
  for (const auto& [name, value] : py::cast<py::dict>(room.attr("__dict__")))
    if (PyType_Check(value.ptr()) &&
        py::detail::get_type_info(reinterpret_cast<PyTypeObject*>(value.ptr())) != nullptr)
      py::setattr(value, "__reduce_ex__", reduce);
}

void refuse_uninitialised(const py::module_& room) {
  for (const auto& [name, value] : py::cast<py::dict>(room.attr("__dict__"))) {
    if (!PyType_Check(value.ptr())) continue;
    auto* const info = py::detail::get_type_info(reinterpret_cast<PyTypeObject*>(value.ptr()));
    if (info != nullptr) info->operator_new = &refuse_memory;
  }
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
