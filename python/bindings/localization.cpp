#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/options.hpp"
#include "python/bindings/rooms.hpp"
#include "python/bindings/sample_cast.hpp"
#include "python/bindings/states.hpp"
#include "python/bindings/trajectories.hpp"
#include "python/bindings/values.hpp"
#include "waymark/app/localize/localize_log.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/pipeline/localizer.hpp"

namespace waymark::python {
namespace {

/// Applies keyword options to the fields of the selected method.
void take_options(LocalizationKind method, const py::dict& given, RiekfOptions& filter,
                  AnchorOptions& anchor) {
  if (method == LocalizationKind::Anchor) {
    update_options(anchor, given);
  } else {
    update_options(filter, given);
  }
}

LocalizerSetup localizer_setup(const TagMap& map, const RobotDescription& robot, const std::string& method,
                               const py::kwargs& given) {
  LocalizerSetup setup{.landmarks = Landmarks(map), .tags = map};
  setup.sensor = {
      .camera = robot.camera, .base_T_sensor = robot.model.base_T_cam, .more_cameras = robot.more_cameras};
  setup.method = value_of(parse_localization_method(method));
  take_options(setup.method, given, setup.filter, setup.anchor);
  return setup;
}

std::unique_ptr<Localizer> make(const TagMap& map, const RobotDescription& robot, const std::string& method,
                                const py::kwargs& given) {
  return std::make_unique<Localizer>(value_of(Localizer::make(localizer_setup(map, robot, method, given))));
}

/// Passes samples from a list or any other iterable to a localizer.
void add_all(Localizer& localizer, const py::iterable& samples) {
  for (const py::handle& sample : samples) localizer.add(sample_of(sample));
}

PoseList listed(const std::vector<LocalizationEstimate>& estimates) {
  PoseList list;
  for (const LocalizationEstimate& at : estimates)
    list.poses.push_back({at.stamp, lift(at.map_T_base), at.covariance});
  return list;
}

/// Localizes with samples and collects the confident estimate after each tag frame, or the smoothed
/// trajectory.
class Run {
 public:
  explicit Run(const LocalizerSetup& setup)
      : localizer_(value_of(Localizer::make(setup))), method_(setup.method) {}

  void add(const Sample& sample) {
    localizer_.add(sample);
    const bool sees = std::holds_alternative<TagFrame>(sample) ||
                      std::holds_alternative<TagPoseFrame>(sample) ||
                      std::holds_alternative<RangeBearing>(sample);
    if (!sees) return;
    const auto estimate = localizer_.estimate();
    if (!estimate || !estimate->certain) return;
    if (estimates_.empty() || estimates_.back().stamp < estimate->stamp) estimates_.push_back(*estimate);
  }
  [[nodiscard]] PoseList end() const {
    return listed(method_ == LocalizationKind::Smoother ? localizer_.smoothed() : estimates_);
  }

 private:
  Localizer localizer_;
  LocalizationKind method_;
  std::vector<LocalizationEstimate> estimates_{};
};

/// Localizes with samples owned by Python, which are copied in blocks and filtered without the GIL.
PoseList localize(const py::iterable& samples, const TagMap& map, const RobotDescription& robot,
                  const std::string& method, const py::kwargs& given) {
  constexpr std::size_t kTogether = 256;
  Run run(localizer_setup(map, robot, method, given));
  std::vector<Sample> taken;
  taken.reserve(kTogether);
  const auto filter = [&] {
    const py::gil_scoped_release release;
    for (const Sample& sample : taken) run.add(sample);
    taken.clear();
  };
  for (const py::handle& sample : samples) {
    taken.push_back(sample_of(sample));
    if (taken.size() == kTogether) filter();
  }
  filter();
  const py::gil_scoped_release release;
  return run.end();
}

PoseList localize_recording(const std::filesystem::path& recording, const std::filesystem::path& map,
                            const std::string& method, const py::kwargs& given) {
  LocalizeJob job{.logs = {recording.string()}, .map = map.string()};
  job.method = value_of(parse_localization_method(method));
  take_options(job.method, given, job.filter, job.anchor);
  const py::gil_scoped_release release;
  const LocalizeInputs inputs = value_of(read_localize_inputs(job, {}));
  Run run(inputs.setup);
  for (const Sample& sample : inputs.samples) run.add(sample);
  return run.end();
}

}  // namespace

void bind_localization(py::module_& m) {
  m.doc() =
      "Pose of the robot from mapped tags and odometry, with covariance "
      "(docs/concepts/localization.md).";
  py::class_<LocalizationEstimate> estimate(m, "LocalizationEstimate", "Estimated pose of the robot.");
  estimate.def_property_readonly(
      "stamp_ns", [](const LocalizationEstimate& e) { return e.stamp.time_since_epoch().count(); }, "[ns]");
  estimate.def_readonly("map_T_base", &LocalizationEstimate::map_T_base, "SE2 [m, rad]");
  estimate.def_property_readonly(
      "covariance", [](const LocalizationEstimate& e) { return to_array(e.covariance); },
      "(3, 3) of x, y [m] and yaw [rad] in map coordinates.");
  estimate.def_readonly("certain", &LocalizationEstimate::certain,
                        "Whether confidence is high. If false, do not drive using this estimate.");
  estimate.def_property_readonly("position_sigma_m", &LocalizationEstimate::position_sigma_m,
                                 "The larger standard deviation of the position [m].");

  def_state(estimate);

  py::class_<Localizer> localizer(
      m, "Localizer", "Accepts samples in order of time; the current estimate is available at any time.");
  localizer.def(py::init(&make), py::arg("map"), py::arg("robot"), py::arg("method") = "riekf",
                ("`method`: riekf (right-invariant extended Kalman filter), ekf, anchor (nearest tag and "
                 "odometry), smoother. Options of the filters "
                 "by keyword:\n\n" +
                 options_help<RiekfOptions>() + "\nOptions of anchor:\n\n" + options_help<AnchorOptions>())
                    .c_str());
  localizer.def("add", &Localizer::add, py::arg("sample"),
                "Adds one sample; commands, scans, images and ground truth are ignored.");
  localizer.def("add_all", &add_all, py::arg("samples"), "Adds all samples of an iterable.");
  localizer.def("estimate", &Localizer::estimate, "The latest estimate; None before the first.");
  localizer.def(
      "smoothed", [](const Localizer& l) { return listed(l.smoothed()); },
      "The smoothed Trajectory if the method is smoother; otherwise empty.");
  refuse_pickle(localizer, "it contains the state of a running filter; pickle its estimate()");
  m.def("methods", &localization_methods, "Names of the methods.");
  m.def("localize", &localize, py::arg("samples"), py::arg("map"), py::arg("robot"),
        py::arg("method") = "riekf",
        "Localizes with an iterable of samples in order of time. Returns the Trajectory of the confident "
        "estimates, one per image. Options by keyword are those of Localizer, which accepts samples one by "
        "one.");
  m.def("localize_recording", &localize_recording, py::arg("recording"), py::arg("map"),
        py::arg("method") = "riekf",
        "Localizes a recording in any format, using the map in a folder. Returns the Trajectory of the "
        "confident estimates, one per image. Options by keyword are those of Localizer.");
}

}  // namespace waymark::python
