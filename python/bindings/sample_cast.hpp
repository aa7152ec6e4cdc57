#pragma once

#include <string>
#include <utility>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "waymark/samples/robot_samples.hpp"

namespace waymark::python {

namespace py = pybind11;

/// The sample that a Python object is; raises TypeError where it is none.
[[nodiscard]] inline Sample sample_of(const py::handle& object) {
  py::detail::make_caster<Sample> caster;
  if (!caster.load(object, true))
    throw py::type_error("a " + std::string(py::str(py::type::handle_of(object).attr("__name__"))) +
                         " is no sample: give objects of waymark.samples");
  return py::detail::cast_op<Sample&&>(std::move(caster));
}

}  // namespace waymark::python
