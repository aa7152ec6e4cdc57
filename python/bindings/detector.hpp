#pragma once

#include <pybind11/pybind11.h>

#include "waymark/tags/tag_finder.hpp"

namespace waymark::python {

/// A tag finder and the keyword arguments it was created with.
struct PythonDetector {
  TagFinder finder;
  pybind11::dict keywords;
};

}  // namespace waymark::python
