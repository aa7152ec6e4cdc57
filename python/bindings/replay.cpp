#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "python/bindings/detector.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/options.hpp"
#include "python/bindings/packed.hpp"
#include "python/bindings/rooms.hpp"
#include "python/bindings/sample_cast.hpp"
#include "python/bindings/values.hpp"
#include "waymark/app/common/replay_setup.hpp"
#include "waymark/runtime/replay_session.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/runtime/step_robot.hpp"

namespace waymark::python {
namespace {

const char* word_of(ReplayState state) {
  switch (state) {
    case ReplayState::Waiting:
      return "waiting";
    case ReplayState::Refused:
      return "refused";
    case ReplayState::Driving:
      return "driving";
    case ReplayState::AtStation:
      return "at_station";
    case ReplayState::Stopped:
      return "stopped";
    case ReplayState::Finished:
      return "finished";
    case ReplayState::Incomplete:
      return "incomplete";
  }
  return "unknown";
}

/// A replay of a route in a map folder. It can be driven only once.
struct PythonSession {
  MapFolder folder{};
  std::unique_ptr<Replayer> replayer{};
  bool has_driven = false;
};

/// Arguments of drive().
struct Drive {
  PythonSession& session;
  double timeout_s = 600;
  double period_s = 0.05;
  const PythonDetector* detector = nullptr;
};

ReplayerSetup replay_setup_of(py::dict given, double laps, const std::string& method,
                              const std::string& controller) {
  ReplayerSetup setup;
  setup.replay.laps = laps;
  if (!(laps > 0 && laps <= 1000))
    refuse("laps", fmt::format("{} is outside (0, 1000]", laps), "Pass a number of laps, such as 1.");
  setup.method = value_of(parse_localization_method(method), "method");
  setup.replay.controller = value_of(parse_controller(controller), "controller");
  const auto section = [&](const char* name, auto& options) {
    const py::object found = take(given, name);
    if (found.is_none()) return;
    if (!PyDict_Check(found.ptr())) refuse(name, "the options are not a dictionary", "Write {'key': value}.");
    update_options(options, found);
  };
  section("filter", setup.filter);
  section("follower", setup.replay.follower);
  section("pursuit", setup.replay.pursuit);
  section("actuators", setup.replay.actuators);
  section("profile", setup.replay.profile);
  section("safety", setup.replay.safety);
  section("watch", setup.replay.watch);
  for (const auto& [name, value] : given)
    throw py::type_error("unknown replay option '" + std::string(py::str(name)) + "'");
  return setup;
}

/// Raises TypeError for an image without a detector, or with a size other than that of its camera.
void check_image(const CameraFrame& frame, const Drive& drive) {
  const RobotDescription& robot = *drive.session.folder.robot;
  if (drive.detector == nullptr)
    throw py::type_error(
        "step() returned a CameraFrame, but no detector is given: call drive(..., "
        "detector=waymark.tags.Detector())");
  if (frame.camera != robot.camera_name) return;  // the loop reports unknown cameras
  if (frame.image.width() != robot.camera.width_px() || frame.image.height() != robot.camera.height_px())
    throw py::value_error(
        fmt::format("step() returned an image of {} x {} pixels, but the camera '{}' of the map has {} x {}",
                    frame.image.width(), frame.image.height(), robot.camera_name, robot.camera.width_px(),
                    robot.camera.height_px()));
}

std::vector<Sample> samples_of(const py::object& given, const Drive& drive) {
  if (!py::hasattr(given, "__iter__"))
    throw py::type_error(fmt::format("step() returned {}: expected a list of samples, which may be empty",
                                     std::string(py::repr(given))));
  std::vector<Sample> list;
  for (const py::handle& one : py::iter(given)) {
    list.push_back(sample_of(one));
    if (const auto* frame = std::get_if<CameraFrame>(&list.back())) check_image(*frame, drive);
  }
  return list;
}

/// Gets the sensor samples for one period from the Python robot.
StepRobot::Step step_of(const py::object& robot, const Drive& drive, PendingException& pending) {
  return [&](const VelocityCommand& command, SensorTime now) -> Result<std::vector<Sample>> {
    const py::gil_scoped_acquire acquire;
    return pending.guard([&]() -> Result<std::vector<Sample>> {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      return samples_of(
          robot.attr("step")(command.speed_m_s, command.yaw_rate_rad_s, now.time_since_epoch().count()),
          drive);
    });
  };
}

ReplayListener listener_of(const py::object& on_step, PendingException& pending) {
  ReplayListener listener;
  if (on_step.is_none()) return listener;
  listener.on_step = [&](SensorTime now, const ReplayStep& step) -> Status {
    const py::gil_scoped_acquire acquire;
    return pending.guard([&]() -> Status {
      on_step(now.time_since_epoch().count(), step);
      return {};
    });
  };
  return listener;
}

Result<ReplayEnd> run(const Drive& drive, const py::object& robot, const py::object& on_step,
                      PendingException& pending) {
  StepRobot stepped(step_of(robot, drive, pending),
                    Duration(static_cast<std::int64_t>(drive.period_s * 1e9)));
  ReplaySession session(*drive.session.replayer, listener_of(on_step, pending));
  ImageSearch search;
  if (drive.detector != nullptr) {
    const RobotDescription& described = *drive.session.folder.robot;
    search = {.finder = &drive.detector->finder,
              .cameras = {{described.camera_name, described.camera, described.model.base_T_cam}}};
  }
  RobotLoop loop(stepped, stepped, stepped.pacing(), std::move(search), {.timeout_s = drive.timeout_s});
  const auto driven = loop.drive(session.listener());
  if (!driven) return tl::unexpected(driven.error());
  return session.end(*driven);
}

py::dict replay_dict(const ReplayEnd& end) {
  py::dict answer;
  answer["finished"] = end.finished;
  answer["state"] = word_of(end.state);
  answer["reason"] = end.reason;
  answer["given_up"] = end.given_up;
  answer["timed_out"] = end.timed_out;
  answer["driven_m"] = end.driven_m;
  answer["stops"] = end.stops;
  answer["frames"] = end.frames;
  answer["lap_s"] = end.lap_s;
  return answer;
}

std::unique_ptr<PythonSession> make_session(const std::filesystem::path& map, const std::string& route,
                                            double laps, const std::string& method,
                                            const std::string& controller, const py::kwargs& given) {
  auto session =
      std::make_unique<PythonSession>(PythonSession{.folder = value_of(read_map_folder(map, route))});
  session->replayer =
      value_of(make_replayer(session->folder, replay_setup_of(given, laps, method, controller)));
  return session;
}

void check_callables(const py::object& robot, const py::object& on_step) {
  if (PyType_Check(robot.ptr()))
    throw py::type_error(fmt::format("robot is the class {0}: expected an instance, {0}(...)",
                                     std::string(py::str(robot.attr("__name__")))));
  if (!py::hasattr(robot, "step"))
    throw py::type_error("the robot has no method step(speed_m_s, yaw_rate_rad_s, now_ns)");
  if (!on_step.is_none() && PyCallable_Check(on_step.ptr()) == 0)
    throw py::type_error(fmt::format("on_step is {}: expected a function on_step(now_ns, step), or None",
                                     std::string(py::repr(on_step))));
}

py::dict drive_session(PythonSession& session, const py::object& robot, double timeout_s, double period_s,
                       const PythonDetector* detector, const py::object& on_step) {
  check_callables(robot, on_step);
  if (!(period_s >= 0.001 && period_s <= 1)) refuse("period_s", "not a period from 0.001 to 1 s");
  if (!(timeout_s > 0))
    refuse("timeout_s", fmt::format("{} s is not a positive duration", timeout_s),
           "Pass seconds above 0, or inf.");
  if (session.has_driven)
    throw py::value_error(
        "this session has already been driven: create another ReplaySession for the next drive");
  session.has_driven = true;
  const Drive drive{.session = session, .timeout_s = timeout_s, .period_s = period_s, .detector = detector};
  PendingException pending;
  Result<ReplayEnd> end;
  {
    const py::gil_scoped_release release;
    end = run(drive, robot, on_step, pending);
  }
  pending.rethrow();
  return replay_dict(value_of(std::move(end)));
}

py::dict drive_robot(const std::filesystem::path& map, const py::object& robot, const std::string& route,
                     double laps, const std::string& method, const std::string& controller, double timeout_s,
                     double period_s, const PythonDetector* detector, const py::object& on_step,
                     const py::kwargs& given) {
  const auto session = make_session(map, route, laps, method, controller, given);
  return drive_session(*session, robot, timeout_s, period_s, detector, on_step);
}

constexpr const char* kDriving =
    "robot.step(speed_m_s, yaw_rate_rad_s, now_ns) applies the command for one period and returns the "
    "samples that its sensors measured until now_ns (TagFrame, or CameraFrame if a detector is given; "
    "Odometry; ImuSample; LaserScan). on_step(now_ns, ReplayStep) is called with every decision. However the "
    "drive ends, the last command is zero. An exception in the robot or in on_step ends the drive and is "
    "re-raised. Returns a dictionary with finished, state, reason, driven_m, stops, frames and lap_s.";

std::string replay_options_help() {
  return "Dictionaries of options: filter, follower, pursuit, actuators, profile, watch, "
         "safety:\n\nfollower:\n" +
         options_help<FollowerOptions>() + "pursuit:\n" + options_help<PurePursuitOptions>() + "safety:\n" +
         options_help<SafetyOptions>();
}

void bind_session(py::module_& m) {
  py::class_<PythonSession> session(m, "ReplaySession",
                                    "Replays a route from a map folder with a custom robot, which is a "
                                    "Python object with a method step(). It can be driven only once.");
  session.def(py::init(&make_session), py::arg("map"), py::arg("route") = "", py::arg("laps") = 1.0,
              py::arg("method") = "riekf", py::arg("controller") = "follower",
              ("Reads the map folder. " + replay_options_help()).c_str());
  session.def("drive", &drive_session, py::arg("robot"), py::arg("timeout_s") = 600.0,
              py::arg("period_s") = 0.05, py::arg("detector") = static_cast<const PythonDetector*>(nullptr),
              py::arg("on_step") = py::none(), kDriving);
  refuse_pickle(session, "it drives a robot; create it again from the map folder");
}

}  // namespace

void bind_replay(py::module_& m) {
  m.doc() = "Drives a custom robot along a route (docs/concepts/replay.md).";
  py::class_<ReplayStep> step(m, "ReplayStep", "The command sent to the robot, with the state and reason.");
  step.def_property_readonly(
      "state", [](const ReplayStep& s) { return word_of(s.state); },
      "waiting, refused, driving, at_station, stopped, finished or incomplete.");
  step.def_property_readonly(
      "speed_m_s", [](const ReplayStep& s) { return s.command.speed_m_s; }, "[m/s]");
  step.def_property_readonly(
      "yaw_rate_rad_s", [](const ReplayStep& s) { return s.command.yaw_rate_rad_s; }, "[rad/s]");
  step.def_readonly("reason", &ReplayStep::reason,
                    "Reason for a refusal, a stop, or a pause; otherwise None.");
  step.def_readonly("estimate", &ReplayStep::estimate, "LocalizationEstimate; None before the first.");
  step.def_readonly("driven_m", &ReplayStep::driven_m,
                    "Distance driven along the route since the start [m].");
  step.def("__repr__", [](const ReplayStep& s) {
    return fmt::format("ReplayStep({}, {:.3f} m/s, {:.3f} rad/s, {:.2f} m driven)", word_of(s.state),
                       s.command.speed_m_s, s.command.yaw_rate_rad_s, s.driven_m);
  });
  def_packed(step);
  bind_session(m);
  m.def("drive", &drive_robot, py::arg("map"), py::arg("robot"), py::arg("route") = "", py::arg("laps") = 1.0,
        py::arg("method") = "riekf", py::arg("controller") = "follower", py::arg("timeout_s") = 600.0,
        py::arg("period_s") = 0.05, py::arg("detector") = static_cast<const PythonDetector*>(nullptr),
        py::arg("on_step") = py::none(),
        ("ReplaySession(map, route, ...).drive(robot, ...) in one call. " + std::string(kDriving) + " " +
         replay_options_help())
            .c_str());
}

}  // namespace waymark::python
