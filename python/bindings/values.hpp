#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "python/bindings/arrays.hpp"
#include "waymark/base/time.hpp"

namespace waymark::python {

namespace py = pybind11;

/// Adds repr(), ==, copy and pickle to a class of plain values, using its attribute names in order.
void finish_value(const py::object& cls, const std::vector<std::string>& names);

/// Makes a class comparable (==) by its pickled state, and unhashable.
void finish_state(const py::object& cls);

/// Makes pickle and copy of a class raise TypeError with a reason such as "it holds an open file".
void refuse_pickle(const py::object& cls, const std::string& reason);

/// Makes pickle protocols 0 and 1 work like protocol 2 for the classes in a module; otherwise, they would
/// create objects without values.
void pickle_by_protocol_2(const py::module_& room);

/// Makes every use of an object whose __init__() was not called raise TypeError.
void refuse_uninitialised(const py::module_& room);

/// Sets attributes from keywords; raises TypeError for unknown keywords.
void set_attributes(const py::object& self, const py::object& cls, const py::kwargs& given);

/// Defines `Class(name=value, …)` for a struct whose fields all have defaults.
template <class T, class... Extra>
void def_keyword_init(py::class_<T, Extra...>& cls) {
  cls.def(py::init([cls_ptr = cls.ptr()](const py::kwargs& given) {
    auto value = std::make_unique<T>();
    {
      const py::object self = py::cast(value.get(), py::return_value_policy::reference);
      set_attributes(self, py::reinterpret_borrow<py::object>(cls_ptr), given);
    }  // the reference ends before the value gets its owner
    return value;
  }));
}

/// Defines an attribute that accepts only finite numbers.
template <class T, class Number, class... Extra>
void def_number(py::class_<T, Extra...>& cls, const char* name, Number T::*member, const char* doc) {
  cls.def_property(
      name, [member](const T& value) { return value.*member; },
      [member, name](T& value, double number) { value.*member = static_cast<Number>(finite(number, name)); },
      doc);
}

/// Defines the attribute stamp_ns for a struct with a `stamp`: nanoseconds on the sensor clock.
template <class T, class... Extra>
void def_stamp(py::class_<T, Extra...>& cls) {
  cls.def_property(
      "stamp_ns", [](const T& value) { return value.stamp.time_since_epoch().count(); },
      [](T& value, std::int64_t ns) { value.stamp = SensorTime(Duration(ns)); },
      "Measurement time on the sensor clock [ns]; for a camera, the middle of the exposure.");
}

}  // namespace waymark::python
