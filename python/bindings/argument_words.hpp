#pragma once

#include <pybind11/pybind11.h>

namespace waymark::python {

/// Explains arguments of the wrong type for every function, method and attribute of a module. The TypeError
/// contains the argument's name, the expected type and the given value (waymark/_arguments.py) instead of
/// pybind11's list of signatures.
void explain_arguments(const pybind11::module_& room);

}  // namespace waymark::python
