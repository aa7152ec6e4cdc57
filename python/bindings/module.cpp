#include <pybind11/pybind11.h>

#include "python/bindings/argument_words.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/rooms.hpp"
#include "python/bindings/values.hpp"

namespace {

using Bind = void (*)(pybind11::module_&);

struct Room {
  const char* name;
  Bind bind;
};

constexpr Room kRooms[] = {
    // classes must be registered before the functions that use them
    {"geometry", waymark::python::bind_geometry},
    {"image", waymark::python::bind_image},
    {"families", waymark::python::bind_families},
    {"camera", waymark::python::bind_camera},
    {"samples", waymark::python::bind_samples},
    {"samples", waymark::python::bind_maps},
    {"tags", waymark::python::bind_tags},
    {"pose", waymark::python::bind_pose},
    {"config", waymark::python::bind_config},
    {"evaluation", waymark::python::bind_evaluation},
    {"recording", waymark::python::bind_recording},
    {"mapping", waymark::python::bind_mapping},
    {"localization", waymark::python::bind_localization},
    {"simulation", waymark::python::bind_simulation},
    {"replay", waymark::python::bind_replay},
};

}  // namespace

PYBIND11_MODULE(_waymark, m) {
  m.doc() = "Waymark: teach a robot a route once and repeat it, using AprilTags. One module per room.";
  m.attr("__version__") = WAYMARK_VERSION;
  waymark::python::bind_errors();
  for (const Room& room : kRooms) {
    pybind11::module_ inner = pybind11::hasattr(m, room.name) ? m.attr(room.name).cast<pybind11::module_>()
                                                              : m.def_submodule(room.name);
    room.bind(inner);
    waymark::python::refuse_uninitialised(inner);
    waymark::python::pickle_by_protocol_2(inner);
    waymark::python::explain_arguments(inner);
  }
}
