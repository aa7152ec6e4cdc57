#pragma once

#include <pybind11/pybind11.h>

namespace waymark::python {

/// Makes every function, method and attribute of a module report an argument of the wrong type by a TypeError
/// with the argument's name, the expected type and the given type (waymark/_arguments.py), instead of
/// pybind11's list of signatures.
void explain_arguments(const pybind11::module_& room);

}  // namespace waymark::python
