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

/// Gives a class of plain values its repr(), ==, copy and pickle from the names of its attributes, in order.
void finish_value(const py::object& cls, const std::vector<std::string>& names);

/// Gives a class whose pickle is its state == by that state, and no hash.
void finish_state(const py::object& cls);

/// Lets pickle and copy refuse a class, with the reason: "it holds an open file".
void refuse_pickle(const py::object& cls, const std::string& reason);

/// Lets the classes of a room be pickled by protocols 0 and 1, too, as protocol 2 does: those two would make
/// an object without its value.
void pickle_by_protocol_2(const py::module_& room);

/// Lets every use of an object of the room's classes whose __init__() was not called raise TypeError.
void refuse_uninitialised(const py::module_& room);

/// Sets the attributes that the keywords name; TypeError for one that is not among `names`.
void set_attributes(const py::object& self, const py::object& cls, const py::kwargs& given);

/// `Class(name=value, …)` for a struct with a default for everything.
template <class T, class... Extra>
void def_keyword_init(py::class_<T, Extra...>& cls) {
  cls.def(py::init([cls_ptr = cls.ptr()](const py::kwargs& given) {
    auto value = std::make_unique<T>();
    {
      const py::object self = py::cast(value.get(), py::return_value_policy::reference);
      set_attributes(self, py::reinterpret_borrow<py::object>(cls_ptr), given);
    }  // the reference is gone before the value gets its owner
    return value;
  }));
}

/// An attribute that is a finite number.
template <class T, class Number, class... Extra>
void def_number(py::class_<T, Extra...>& cls, const char* name, Number T::*member, const char* doc) {
  cls.def_property(
      name, [member](const T& value) { return value.*member; },
      [member, name](T& value, double number) { value.*member = static_cast<Number>(finite(number, name)); },
      doc);
}

/// The attribute stamp_ns of a struct with a `stamp`: nanoseconds on the clock of the sensor.
template <class T, class... Extra>
void def_stamp(py::class_<T, Extra...>& cls) {
  cls.def_property(
      "stamp_ns", [](const T& value) { return value.stamp.time_since_epoch().count(); },
      [](T& value, std::int64_t ns) { value.stamp = SensorTime(Duration(ns)); },
      "Time of the measurement on the clock of the sensor [ns]; of a camera the middle of the exposure.");
}

}  // namespace waymark::python
