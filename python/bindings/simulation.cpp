#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/options.hpp"
#include "python/bindings/rooms.hpp"
#include "python/bindings/simulator.hpp"
#include "python/bindings/tag_ids.hpp"
#include "python/bindings/values.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"
#include "waymark/simulation/render/photograph.hpp"

namespace waymark::python {
namespace {

py::dict simulation_dict(const TagTruth& truth) {
  py::dict answer;
  answer["tag"] = to_string(truth.tag);
  answer["cam_T_tag"] = truth.cam_T_tag;
  answer["size_m"] = truth.size_m;
  answer["corners_px"] = py::array_t<double>({4, 2}, truth.corners_px[0].data());
  answer["size_px"] = truth.size_px;
  answer["tilt_rad"] = truth.tilt_rad;
  answer["visible_fraction"] = truth.visible_fraction;
  return answer;
}

TagInScene scene_tag_of(const py::handle& entry) {
  const bool whole =
      (py::isinstance<py::tuple>(entry) || py::isinstance<py::list>(entry)) && py::len(entry) == 3;
  const auto tag = whole ? py::tuple(py::reinterpret_borrow<py::object>(entry)) : py::tuple();
  if (!whole || !py::isinstance<SE3>(tag[1]) || PyNumber_Check(tag[2].ptr()) == 0)
    refuse("tags", fmt::format("the entry {} is not (tag, cam_T_tag, size_m)", std::string(py::repr(entry))),
           "Pass the name or number of the tag, its pose as an SE3, and the side length of its square [m].");
  return {.tag = tag_of(tag[0]), .cam_T_tag = py::cast<SE3>(tag[1]), .size_m = py::cast<double>(tag[2])};
}

py::tuple take_photograph(const CameraModel& camera, const py::iterable& tags, std::uint64_t seed,
                          const py::kwargs& given) {
  const auto options = options_of<PhotographOptions>(given);
  PhotographScene scene;
  for (const py::handle& entry : tags) {
    scene.tags.push_back(scene_tag_of(entry));
  }
  Result<Photograph> taken;
  {
    const py::gil_scoped_release release;
    Random random(seed);
    taken = photograph(camera, scene, options, random);
  }
  Photograph photo = value_of(std::move(taken));
  py::list truths;
  for (const TagTruth& truth : photo.tags) truths.append(simulation_dict(truth));
  return py::make_tuple(to_array(std::move(photo.image)), truths);
}

/// The samples of a scripted lap along the path of the world.
std::vector<Sample> scripted_lap(const World& world, const RobotDescription& robot, std::uint64_t seed,
                                 const py::kwargs& given) {
  SimulatedSetup setup{
      .world = world, .model = robot.model, .camera = robot.camera, .robot = robot.simulation};
  setup.camera_name = robot.camera_name;
  setup.more_cameras = robot.more_cameras;
  setup.robot.seed = seed;
  update_options(setup.robot, given);
  std::vector<Sample> samples;
  Result<LapEnd> end;
  {
    const py::gil_scoped_release release;
    LapListener listener;
    listener.on_sample = [&](const Sample& sample) -> Status {
      samples.push_back(sample);
      return {};
    };
    end = drive_scripted_lap(setup, {}, listener);
  }
  (void)value_of(std::move(end));
  return samples;
}

}  // namespace

void bind_simulation(py::module_& m) {
  m.doc() =
      "Simulated worlds, robots and cameras, with ground truth "
      "(docs/concepts/simulation.md).";
  const std::string options = options_help<SimulatedRobotOptions>();
  m.def("photograph", &take_photograph, py::arg("camera"), py::arg("tags"), py::arg("seed") = 1,
        ("A still photograph of tags (tag, cam_T_tag, size_m). Returns the image (height, width) of uint8, "
         "and the ground truth for each tag as a dictionary. Options by keyword:\n\n" +
         options_help<PhotographOptions>())
            .c_str());
  m.def("scripted_lap", &scripted_lap, py::arg("world"), py::arg("robot"), py::arg("seed") = 1,
        ("The samples of a scripted lap along the path in the world, with tag corners instead of images, and "
         "ground truth. Options of the robot by keyword override those of its description:\n\n" +
         options)
            .c_str());
  py::class_<Simulator> simulator(
      m, "Simulator",
      "A simulated robot whose time advances only on request. It stops if no commands arrive.");
  simulator.def(py::init([](const World& world, const RobotDescription& robot, std::uint64_t seed,
                            bool images, const std::optional<SE2>& start, const py::kwargs& given) {
                  SimulatedRobotOptions simulated = robot.simulation;
                  simulated.seed = seed;
                  update_options(simulated, given);
                  check(waymark::check(simulated));
                  return std::make_unique<Simulator>(world, robot, simulated, images, start);
                }),
                py::arg("world"), py::arg("robot"), py::arg("seed") = 1, py::arg("images") = false,
                py::arg("start") = py::none(),
                ("With images=True, the camera yields CameraFrame, otherwise TagFrame. `start` is an SE2 "
                 "in the map; None means the start of the world's path. Options of the robot by keyword "
                 "override those of its description:\n\n" +
                 options)
                    .c_str());
  simulator.def("next", &Simulator::next, "Advances time to the next sample of any sensor and returns it.");
  simulator.def("advance", &Simulator::advance, py::arg("seconds"),
                "Advances time and returns the samples as a list.");
  simulator.def("command", &Simulator::command, py::arg("speed_m_s"), py::arg("yaw_rate_rad_s"),
                "Sets the command, which applies until the watchdog times out.");
  simulator.def_property_readonly("now_ns", &Simulator::now_ns, "The robot's clock [ns].");
  simulator.def_property_readonly("true_map_T_base", &Simulator::truth,
                                  "Ground truth (SE2); use it only for evaluation, not in an estimator.");
  refuse_pickle(simulator,
                "it contains a running robot; create another one with the same world, robot and seed");
}

}  // namespace waymark::python
