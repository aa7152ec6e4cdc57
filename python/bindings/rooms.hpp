#pragma once

#include <pybind11/pybind11.h>

namespace waymark::python {

/// One function per room: adds its classes and functions to the submodule of the same name.
void bind_geometry(pybind11::module_& m);
void bind_camera(pybind11::module_& m);
void bind_families(pybind11::module_& m);
void bind_samples(pybind11::module_& m);
void bind_maps(pybind11::module_& m);
void bind_tags(pybind11::module_& m);
void bind_pose(pybind11::module_& m);
void bind_config(pybind11::module_& m);
void bind_image(pybind11::module_& m);
void bind_recording(pybind11::module_& m);
void bind_localization(pybind11::module_& m);
void bind_mapping(pybind11::module_& m);
void bind_evaluation(pybind11::module_& m);
void bind_simulation(pybind11::module_& m);
void bind_replay(pybind11::module_& m);

}  // namespace waymark::python
