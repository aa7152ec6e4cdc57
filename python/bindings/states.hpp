#pragma once

#include <pybind11/pybind11.h>

#include "python/bindings/values.hpp"
#include "waymark/localization/method.hpp"
#include "waymark/pose/multi_tag_pose.hpp"
#include "waymark/pose/tag_pose.hpp"
#include "waymark/samples/route.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark::python {

/// The exact state of a value as a tuple for pickle and ==, and the inverse.
[[nodiscard]] py::tuple state_of(const TagMap& map);
void from_state(const py::tuple& state, TagMap& map);
[[nodiscard]] py::tuple state_of(const Route& route);
void from_state(const py::tuple& state, Route& route);
[[nodiscard]] py::tuple state_of(const TagPoseSolution& solution);
void from_state(const py::tuple& state, TagPoseSolution& solution);
[[nodiscard]] py::tuple state_of(const TagPose& pose);
void from_state(const py::tuple& state, TagPose& pose);
[[nodiscard]] py::tuple state_of(const CameraPoseEstimate& estimate);
void from_state(const py::tuple& state, CameraPoseEstimate& estimate);
[[nodiscard]] py::tuple state_of(const LocalizationEstimate& estimate);
void from_state(const py::tuple& state, LocalizationEstimate& estimate);

/// Adds pickle, copy and == to a class without a keyword constructor, using state_of() and from_state().
template <class T>
void def_state(py::class_<T>& cls) {
  cls.def(py::pickle([](const T& value) { return state_of(value); },
                     [](const py::tuple& state) {
                       T value;
                       from_state(state, value);
                       return value;
                     }));
  finish_state(cls);
}

}  // namespace waymark::python
