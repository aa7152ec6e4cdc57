#include "python/bindings/argument_words.hpp"

#include <string>
#include <unordered_map>
#include <utility>

namespace waymark::python {
namespace {

namespace py = pybind11;

/// The dispatcher shared by all pybind11 functions.
PyCFunctionWithKeywords original = nullptr;

/// Attribute name of each setter, keyed by the capsule of its function; pybind11 setters have no name.
std::unordered_map<PyObject*, std::string>& setters() {
  static auto* const names = new std::unordered_map<PyObject*, std::string>();  // outlives the interpreter
  return *names;
}

std::string setter_of(PyObject* self) {
  const auto found = setters().find(self);
  return found == setters().end() ? "" : found->second;
}

/// Replaces the current TypeError with a readable one if pybind11 found no matching signature.
void explain(PyObject* self, PyObject* args, PyObject* kwargs) {
  PyObject *type = nullptr, *value = nullptr, *trace = nullptr;
  PyErr_Fetch(&type, &value, &trace);
  PyErr_NormalizeException(&type, &value, &trace);
  try {
    const std::string text = py::str(py::handle(value));
    if (text.find("(): incompatible ") != std::string::npos) {
      const py::object given = kwargs == nullptr ? py::dict() : py::reinterpret_borrow<py::object>(kwargs);
      const py::object words = py::module_::import("waymark._arguments")
                                   .attr("words")(text, setter_of(self), py::handle(args), given);
      Py_XSETREF(value, PyObject_CallOneArg(PyExc_TypeError, words.ptr()));
    }
  } catch (py::error_already_set& failure) {
    failure.discard_as_unraisable(__func__);
  }
  PyErr_Restore(type, value, trace);
}

PyObject* dispatch(PyObject* self, PyObject* args, PyObject* kwargs) {
  PyObject* const result = original(self, args, kwargs);
  if (result == nullptr && PyErr_ExceptionMatches(PyExc_TypeError) != 0) explain(self, args, kwargs);
  return result;
}

PyCFunction as_function(PyCFunctionWithKeywords call) {
  return reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(call));
}

/// Installs dispatch() in front of the dispatcher of a pybind11 function; other objects are unchanged.
void wrap(PyObject* function, const std::string& setter = {}) {
  if (function == nullptr) return;
  if (PyInstanceMethod_Check(function)) function = PyInstanceMethod_GET_FUNCTION(function);
  if (PyCFunction_Check(function) == 0) return;
  PyMethodDef* const method = reinterpret_cast<PyCFunctionObject*>(function)->m_ml;
  PyObject* const self = PyCFunction_GET_SELF(function);
  if (method->ml_flags != (METH_VARARGS | METH_KEYWORDS) || self == nullptr ||
      PyCapsule_CheckExact(self) == 0)
    return;
  if (!setter.empty()) setters()[self] = setter;
  if (method->ml_meth == as_function(&dispatch)) return;
  original = reinterpret_cast<PyCFunctionWithKeywords>(reinterpret_cast<void (*)()>(method->ml_meth));
  method->ml_meth = as_function(&dispatch);
}

void wrap_class(const py::handle& cls) {
  for (const auto& [name, value] : py::reinterpret_borrow<py::dict>(cls.attr("__dict__").attr("copy")())) {
    if (py::isinstance<py::staticmethod>(value)) wrap(value.attr("__func__").ptr());
    if (Py_TYPE(value.ptr()) == &PyProperty_Type)
      wrap(value.attr("fset").ptr(),
           std::string(py::str(cls.attr("__name__"))) + "." + std::string(py::str(name)));
    wrap(value.ptr());
  }
}

}  // namespace

void explain_arguments(const py::module_& room) {
  for (const auto& [name, value] : py::cast<py::dict>(room.attr("__dict__"))) {
    wrap(value.ptr());
    if (PyType_Check(value.ptr()) &&
        py::detail::get_type_info(reinterpret_cast<PyTypeObject*>(value.ptr())) != nullptr)
      wrap_class(value);
  }
}

}  // namespace waymark::python
