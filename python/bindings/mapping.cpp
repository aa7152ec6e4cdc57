#include <optional>
#include <string>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "python/bindings/errors.hpp"
#include "python/bindings/jobs.hpp"
#include "python/bindings/options.hpp"
#include "python/bindings/packed.hpp"
#include "python/bindings/report_attributes.hpp"
#include "python/bindings/rooms.hpp"
#include "python/bindings/tag_ids.hpp"
#include "python/bindings/trajectories.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark::python {
namespace {

/// Reads the options of one dictionary, such as `chain={...}`.
template <class Options>
void take_section(py::dict& given, const char* name, Options& options) {
  const py::object section = take(given, name);
  if (section.is_none()) return;
  if (!PyDict_Check(section.ptr())) refuse(name, "the options are not a dictionary", "Write {'key': value}.");
  update_options(options, section);
}

/// The value of a keyword; raises TypeError if it has a different type.
template <class T>
T keyword_as(const py::object& value, const std::string& name, const std::string& needed) {
  try {
    return py::cast<T>(value);
  } catch (const py::cast_error&) {
    throw py::type_error("map_recording(): " + name + " is " + needed + ", not " +
                         std::string(py::repr(value)));
  }
}

MapJob job_of(const std::filesystem::path& recording, const std::filesystem::path& folder,
              const py::kwargs& given) {
  py::dict rest = given.attr("copy")();
  MapJob job{.lap = recording, .folder = folder};
  if (const py::object method = take(rest, "method"); !method.is_none())
    job.options.method =
        value_of(parse_map_method(keyword_as<std::string>(method, "method", "a string")), "method");
  if (const py::object anchor = take(rest, "anchor"); !anchor.is_none())
    job.overrides.anchor = to_string(tag_of(anchor));
  if (const py::object pose = take(rest, "map_T_anchor"); !pose.is_none())
    job.overrides.map_T_anchor = keyword_as<SE3>(pose, "map_T_anchor", "an SE3");
  if (const py::object size = take(rest, "tag_size_m"); !size.is_none()) {
    const double size_m = keyword_as<double>(size, "tag_size_m", "a number of metres");
    if (!is_tag_size(size_m))
      refuse("tag_size_m", fmt::format("{} m is not a tag size", size_m),
             "Pass the side of the black square in metres.");
    job.overrides.tag_size_m = size_m;
  }
  take_section(rest, "chain", job.options.chain);
  take_section(rest, "bundle", job.options.bundle);
  take_section(rest, "route", job.options.route);
  for (const auto& [name, value] : rest)
    throw py::type_error(
        "map_recording() has no keyword '" + std::string(py::str(name)) + "'. " +
        suggestion(std::string(py::str(name)), {"progress", "method", "anchor", "map_T_anchor", "tag_size_m",
                                                "chain", "bundle", "route"}));
  return job;
}

MapReport map_file(const std::filesystem::path& recording, const std::filesystem::path& folder,
                   const py::object& progress, const py::kwargs& given) {
  const MapJob job = job_of(recording, folder, given);
  PythonJob control(progress);
  Result<MapReport> report;
  {
    const py::gil_scoped_release release;
    report = map_recording(job, control.control());
  }
  control.rethrow();
  return value_of(std::move(report));
}

}  // namespace

void bind_mapping(py::module_& m) {
  m.doc() =
      "Makes a map of the tags, the trajectory of the robot, and a route from a recorded lap "
      "(docs/concepts/mapping.md).";
  py::class_<MapReport> report(m, "MapReport", "Result of mapping a lap.");
  report.def_property_readonly(
      "map", [](const MapReport& r) { return r.lap.map; }, "TagMap");
  report.def_property_readonly(
      "start_map",
      [](const MapReport& r) -> std::optional<TagMap> {
        return r.lap.bundle ? std::optional(r.lap.bundle->start_map) : std::nullopt;
      },
      "TagMap from the chain method, before the optimisation; None if nothing was optimised.");
  report.def_property_readonly(
      "true_map", [](const MapReport& r) { return r.true_tags; },
      "TagMap with the recorded ground truth; empty if unknown.");
  report.def_property_readonly(
      "route", [](const MapReport& r) { return r.lap.route; }, "Route");
  report.def_property_readonly(
      "trajectory", [](const MapReport& r) { return listed(r.lap.trajectory); }, "Trajectory of the base.");
  report.def_property_readonly(
      "true_trajectory", [](const MapReport& r) { return listed(r.true_path); },
      "Recorded ground truth poses of the base (Trajectory); empty if the recording has none.");
  report.def_property_readonly(
      "warnings", [](const MapReport& r) { return r.warnings; }, "Warnings about the map, as text.");
  report.def_property_readonly(
      "files", [](const MapReport& r) { return r.files; }, "The written files.");
  report.def_readonly("backed_up", &MapReport::renamed_files,
                      "Files of an earlier map in the folder that were backed up (map.1.yaml): list of str.");
  report.def("__repr__", [](const MapReport& r) {
    return fmt::format("MapReport({} tags, {} points of the route, {} warnings)", r.lap.map.tags.size(),
                       r.lap.route.points.size(), r.warnings.size());
  });
  report.def_property_readonly(
      "summary", [](const MapReport& r) { return to_python(fields(r)); },
      "summary.json as a dictionary. Each key is also an attribute, which is None if the key is missing.");
  def_report_attributes(report);
  def_packed(report);
  m.def("map_recording", &map_file, py::arg("recording"), py::arg("folder"), py::arg("progress") = py::none(),
        ("Maps a recorded lap in any format and writes map.yaml, route.yaml, … into the folder, like "
         "`waymark map`. The files of an earlier map in the folder are kept as backups (map.1.yaml; "
         "MapReport.backed_up). progress(text, done, all) is called during the job; if it raises an "
         "exception, or on Ctrl-C, the folder remains unchanged. Keywords: method ('bundle', 'chain'), "
         "anchor, map_T_anchor (SE3), tag_size_m, and dictionaries of options:\n\nchain:\n" +
         options_help<ChainOptions>() + "bundle:\n" + options_help<BundleMapOptions>() + "route:\n" +
         options_help<RouteOptions>())
            .c_str());
}

}  // namespace waymark::python
