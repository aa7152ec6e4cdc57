#pragma once

#include <string>

#include <pybind11/pybind11.h>

#include "python/bindings/errors.hpp"
#include "waymark/families/family.hpp"

namespace waymark::python {

/// Parses a tag name from Python: "tag36h11:7", or the number of a tag in tag36h11.
[[nodiscard]] inline TagId tag_of(const py::handle& tag) {
  if (PyUnicode_Check(tag.ptr())) return value_of(parse_tag_id(py::cast<std::string>(tag)));
  if (PyIndex_Check(tag.ptr()) && !PyBool_Check(tag.ptr()))
    return value_of(parse_tag_id("tag36h11:" + std::string(py::str(tag))));
  refuse("tag", "the tag is neither a string nor a number", "Write 'tag36h11:7', or 7 for tag36h11:7.");
}

}  // namespace waymark::python
