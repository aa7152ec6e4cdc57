#include <string>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/packed.hpp"
#include "python/bindings/rooms.hpp"
#include "python/bindings/trajectories.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/config/yaml/world_file.hpp"

namespace waymark::python {
namespace {

using Path = std::filesystem::path;

py::array_t<std::uint8_t> read_grey(const Path& path) {
  Result<Image> image;
  {
    const py::gil_scoped_release release;
    image = read_image(path);
  }
  return to_array(value_of(std::move(image)));
}

void write_grey(const Path& path, const py::object& image) {
  const ImageView view = image_view(image);
  Status status;
  {
    const py::gil_scoped_release release;
    status = write_image(path, view);
  }
  check(status);
}

World world_named(const Path& name) { return value_of(read_world(value_of(find_shared("worlds", name)))); }

RobotDescription robot_named(const Path& name) {
  return value_of(read_robot(value_of(find_shared("robots", name))));
}

void bind_descriptions(py::module_& m) {
  py::class_<World> world(m, "World", "Tags and a path to drive.");
  world.def_readonly("name", &World::name, "Name of the world, such as circuit24.");
  world.def_readwrite("tags", &World::tags, "TagMap (a copy; assign to change it).");
  world.def_property_readonly(
      "path_m",
      [](const World& w) {
        py::array_t<double> array({static_cast<py::ssize_t>(w.path_m.size()), py::ssize_t{2}});
        for (std::size_t i = 0; i < w.path_m.size(); ++i)
          Eigen::Map<Eigen::Vector2d>{array.mutable_data(static_cast<py::ssize_t>(i), 0)} = w.path_m[i];
        return array;
      },
      "The path to drive, (n, 2) [m].");
  world.def_readonly("path_closed", &World::path_closed,
                     "Whether the path is closed: its last point connects to its first.");
  def_packed(world);
  py::class_<RobotDescription> robot(m, "RobotDescription", "A robot's body, camera, mounting and limits.");
  robot.def(
      "to_yaml", [](const RobotDescription& r) { return to_yaml(r); },
      "The text of its robot file (docs/formats/robot.md).");
  robot.def_property_readonly(
      "name", [](const RobotDescription& r) { return r.model.name; }, "Name of the robot, such as limo.");
  robot.def_readwrite("camera", &RobotDescription::camera, "CameraModel");
  robot.def_property(
      "base_T_cam", [](const RobotDescription& r) { return r.model.base_T_cam; },
      [](RobotDescription& r, const SE3& base_T_cam) { r.model.base_T_cam = base_T_cam; },
      "SE3; base: x forward, y left, z up, on the floor; optical frame: x right, y down, z forward.");
  robot.def_property_readonly(
      "speed_m_s", [](const RobotDescription& r) { return r.model.limits.speed_m_s; },
      "Maximum speed [m/s].");
  robot.def_property_readonly(
      "yaw_rate_rad_s", [](const RobotDescription& r) { return r.model.limits.yaw_rate_rad_s; },
      "Maximum yaw rate [rad/s].");
  robot.def_property_readonly(
      "track_m", [](const RobotDescription& r) { return r.model.track_m; },
      "Distance between the left and right wheels [m].");
  robot.def_property_readonly(
      "wheel_radius_m", [](const RobotDescription& r) { return r.model.wheel_radius_m; }, "[m]");
  def_packed(robot);
}

}  // namespace

void bind_image(py::module_& m) {
  m.doc() = "Grey images as NumPy arrays (height, width) of uint8.";
  m.def(
      "read", &read_grey, py::arg("path"),
      "Reads an image in any supported format as grey levels. The array owns the pixels; nothing is copied.");
  m.def("write", &write_grey, py::arg("path"), py::arg("image"),
        "Writes a grey image; the file extension selects the format: .png, .jpg or .pgm.");
}

void bind_config(py::module_& m) {
  m.doc() = "Files for worlds, robots, maps, routes and trajectories.";
  bind_descriptions(m);
  m.def("read_world", &world_named, py::arg("name"),
        "Reads a world from a file, or a built-in world by its name, such as 'circuit24'.");
  m.def("read_robot", &robot_named, py::arg("name"),
        "Reads a robot from a file, or a built-in robot by its name, such as 'limo'.");
  m.def(
      "read_map", [](const Path& path) { return value_of(read_map(path)).tags; }, py::arg("path"),
      "Reads the TagMap from map.yaml.");
  m.def(
      "write_map",
      [](const Path& path, const TagMap& tags, const std::string& method) {
        if (tags.tags.empty())
          refuse("tags", "the map is empty", "Add a tag: tags['tag36h11:0'] = MappedTag(…).");
        check(write_map(
            path, {.tags = tags, .anchor = tags.tags.begin()->first, .provenance = {{"method", method}}}));
      },
      py::arg("path"), py::arg("tags"), py::arg("method") = "python",
      "Writes a TagMap as map.yaml; the first tag becomes the anchor.");
  m.def(
      "read_route", [](const Path& path) { return value_of(read_route(path)); }, py::arg("path"),
      "Reads the Route from route.yaml.");
  m.def(
      "read_trajectory", [](const Path& path) { return listed(value_of(read_trajectory(path))); },
      py::arg("path"), "Reads a Trajectory from a file in TUM format.");
  m.def(
      "to_tum", [](const PoseList& list) { return to_tum(plain(list)); }, py::arg("trajectory"),
      "The trajectory as text in TUM format.");
}

}  // namespace waymark::python
