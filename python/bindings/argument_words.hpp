#pragma once

#include <pybind11/pybind11.h>

namespace waymark::python {

/// Lets every function, method and attribute of a room that is given an argument of a wrong type raise a
/// TypeError with the name of the argument, what is needed and what was given (waymark/_arguments.py), where
/// pybind11 lists signatures.
void explain_arguments(const pybind11::module_& room);

}  // namespace waymark::python
