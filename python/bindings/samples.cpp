#include <algorithm>
#include <cmath>
#include <optional>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/rooms.hpp"
#include "python/bindings/tag_ids.hpp"
#include "python/bindings/values.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark::python {
namespace {

/// A view of the corners inside the detection, (4, 2).
py::array_t<double> corners_view(const py::object& self) {
  auto& detection = py::cast<TagDetection&>(self);
  return py::array_t<double>({4, 2}, detection.corners_px[0].data(), self);
}

void set_corners(TagDetection& detection, const py::object& corners) {
  const Eigen::Matrix<double, 4, 2> px = matrix_of<4, 2>(corners, "corners_px");
  for (int i = 0; i < 4; ++i) detection.corners_px[static_cast<std::size_t>(i)] = px.row(i);
}

py::object corner_covariance(const TagDetection& detection) {
  if (!detection.corner_covariance_px2) return py::none();
  return to_array(*detection.corner_covariance_px2);
}

void set_corner_covariance(TagDetection& detection, const py::object& covariance) {
  detection.corner_covariance_px2.reset();
  if (!covariance.is_none())
    detection.corner_covariance_px2 = matrix_of<8, 8>(covariance, "corner_covariance_px2");
}

void set_corner_state(TagDetection& detection, const std::string& name) {
  for (const CornerState state : {CornerState::Measured, CornerState::Unreliable}) {
    if (name != to_string(state)) continue;
    detection.corner_state = state;
    return;
  }
  refuse("corner_state", "unknown state '" + name + "'", "Known: measured, unreliable.");
}

template <class T>
void def_tag(py::class_<T>& cls) {
  cls.def_property(
      "tag", [](const T& value) { return to_string(value.tag); },
      [](T& value, const py::object& tag) { value.tag = tag_of(tag); },
      "Name of the tag, such as 'tag36h11:7'; a plain number is an id in tag36h11.");
}

void bind_detection(py::module_& m) {
  py::class_<TagDetection> cls(m, "TagDetection", "One tag in one image.");
  def_tag(cls);
  cls.def_property_readonly(
      "id", [](const TagDetection& d) { return d.tag.number; }, "Number of the tag in its family.");
  cls.def_readwrite("hamming", &TagDetection::hamming, "Number of corrected bits.");
  def_number(cls, "decision_margin", &TagDetection::decision_margin,
             "Mean distance of the data bits from the black/white threshold [grey levels].");
  cls.def_property("corners_px", &corners_view, &set_corners,
                   "TL, TR, BR, BL of the printed tag, (4, 2) [px], with pixel centres at + 1/2; a view into "
                   "the detection.");
  cls.def_property("corner_covariance_px2", &corner_covariance, &set_corner_covariance,
                   "(8, 8) of x0 y0 x1 y1 … [px^2]; None if unknown.");
  cls.def_property(
      "corner_state", [](const TagDetection& d) { return std::string(to_string(d.corner_state)); },
      &set_corner_state,
      "'measured', or 'unreliable' if the image contradicts the corners. Estimators leave out unreliable "
      "corners.");
  cls.def_property_readonly(
      "center_px", [](const TagDetection& d) { return to_array(center_px(d.corners_px)); },
      "Intersection of the diagonals, (2,) [px].");
  cls.def_property_readonly(
      "side_px", [](const TagDetection& d) { return mean_side_px(d.corners_px); }, "Mean side length [px].");
  finish_value(cls,
               {"tag", "hamming", "decision_margin", "corners_px", "corner_covariance_px2", "corner_state"});
  def_keyword_init(cls);
}

void bind_camera_samples(py::module_& m) {
  py::class_<TagFrame> tags(m, "TagFrame",
                            "Tags detected in one image; the list is empty if none were found.");
  def_stamp(tags);
  tags.def_readwrite("camera", &TagFrame::camera, "Name of the camera.");
  tags.def_readwrite("detections", &TagFrame::detections,
                     "List of TagDetection (a copy; assign a list to change it).");
  finish_value(tags, {"stamp_ns", "camera", "detections"});
  def_keyword_init(tags);

  py::class_<CameraFrame> camera_frame(m, "CameraFrame", "A grey image.");
  def_stamp(camera_frame);
  camera_frame.def_readwrite("camera", &CameraFrame::camera, "Name of the camera.");
  camera_frame.def_property_readonly(
      "image",
      [](const py::object& self) -> py::array {
        auto& frame = py::cast<CameraFrame&>(self);
        if (frame.image.empty()) return py::array_t<std::uint8_t>(std::vector<py::ssize_t>{0, 0});
        return py::array_t<std::uint8_t>({frame.image.height(), frame.image.width()}, frame.image.row(0),
                                         self);
      },
      "(height, width) uint8; a view into the frame.");
  camera_frame.def(py::init([](std::int64_t stamp_ns, const py::object& image, std::string camera) {
                     const ImageView view = image_view(image);
                     CameraFrame frame{.stamp = SensorTime(Duration(stamp_ns)),
                                       .camera = std::move(camera),
                                       .image = Image(view.width, view.height)};
                     for (int y = 0; y < view.height; ++y)
                       std::copy_n(view.row(y), view.width, frame.image.row(y));
                     return frame;
                   }),
                   py::arg("stamp_ns"), py::arg("image"), py::arg("camera") = "cam",
                   "Copies an image (height, width) of uint8 into the frame.");
  finish_value(camera_frame, {"stamp_ns", "camera", "image"});

  py::class_<SeenTagPose> seen(m, "SeenTagPose",
                               "A tag pose in the camera frame, estimated by the robot's own software.");
  def_tag(seen);
  seen.def_readwrite("cam_T_tag", &SeenTagPose::cam_T_tag,
                     "SE3; tag frame: centre, x right, y down, z into the tag.");
  finish_value(seen, {"tag", "cam_T_tag"});
  def_keyword_init(seen);
  py::class_<TagPoseFrame> poses(m, "TagPoseFrame", "Tag poses from one image.");
  def_stamp(poses);
  poses.def_readwrite("camera", &TagPoseFrame::camera, "Name of the camera.");
  poses.def_readwrite("tags", &TagPoseFrame::tags,
                      "List of SeenTagPose (a copy; assign a list to change it).");
  finish_value(poses, {"stamp_ns", "camera", "tags"});
  def_keyword_init(poses);
}

void bind_motion_samples(py::module_& m) {
  py::class_<Odometry> odometry(m, "Odometry", "Pose from wheel odometry since the robot was switched on.");
  def_stamp(odometry);
  odometry.def_readwrite("odom_T_base", &Odometry::odom_T_base, "SE2 [m, rad].");
  def_number(odometry, "speed_m_s", &Odometry::speed_m_s, "Along base x [m/s].");
  def_number(odometry, "yaw_rate_rad_s", &Odometry::yaw_rate_rad_s, "About base z [rad/s].");
  finish_value(odometry, {"stamp_ns", "odom_T_base", "speed_m_s", "yaw_rate_rad_s"});
  def_keyword_init(odometry);

  py::class_<WheelTicks> wheels(m, "WheelTicks",
                                "Wheel angles on each side since the robot was switched on.");
  def_stamp(wheels);
  def_number(wheels, "left_rad", &WheelTicks::left_rad, "[rad]");
  def_number(wheels, "right_rad", &WheelTicks::right_rad, "[rad]");
  finish_value(wheels, {"stamp_ns", "left_rad", "right_rad"});
  def_keyword_init(wheels);

  py::class_<ImuSample> imu(m, "ImuSample", "Yaw rate and specific force in base axes.");
  def_stamp(imu);
  imu.def_property(
      "angular_velocity_rad_s", [](const ImuSample& s) { return to_array(s.angular_velocity_rad_s); },
      [](ImuSample& s, const py::object& v) {
        s.angular_velocity_rad_s = matrix_of<3, 1>(v, "angular_velocity_rad_s");
      },
      "(3,) [rad/s]");
  imu.def_property(
      "linear_acceleration_m_s2", [](const ImuSample& s) { return to_array(s.linear_acceleration_m_s2); },
      [](ImuSample& s, const py::object& v) {
        s.linear_acceleration_m_s2 = matrix_of<3, 1>(v, "linear_acceleration_m_s2");
      },
      "(3,) [m/s^2]");
  finish_value(imu, {"stamp_ns", "angular_velocity_rad_s", "linear_acceleration_m_s2"});
  def_keyword_init(imu);

  py::class_<StampedCommand> command(m, "StampedCommand", "A command with its stamp.");
  def_stamp(command);
  command.def_property(
      "speed_m_s", [](const StampedCommand& c) { return c.command.speed_m_s; },
      [](StampedCommand& c, double v) { c.command.speed_m_s = finite(v, "speed_m_s"); }, "[m/s]");
  command.def_property(
      "yaw_rate_rad_s", [](const StampedCommand& c) { return c.command.yaw_rate_rad_s; },
      [](StampedCommand& c, double v) { c.command.yaw_rate_rad_s = finite(v, "yaw_rate_rad_s"); }, "[rad/s]");
  finish_value(command, {"stamp_ns", "speed_m_s", "yaw_rate_rad_s"});
  def_keyword_init(command);

  py::class_<TruthPose> truth(m, "TruthPose",
                              "Ground truth pose from a simulator or a motion capture system.");
  def_stamp(truth);
  truth.def_readwrite("map_T_base", &TruthPose::map_T_base, "SE3 [m, rad].");
  finish_value(truth, {"stamp_ns", "map_T_base"});
  def_keyword_init(truth);
}

void bind_other_samples(py::module_& m) {
  py::class_<RangeBearing> range(m, "RangeBearing", "Range and bearing of a numbered landmark.");
  def_stamp(range);
  range.def_readwrite("landmark", &RangeBearing::landmark, "Number of the landmark.");
  def_number(range, "range_m", &RangeBearing::range_m, "[m]");
  def_number(range, "bearing_rad", &RangeBearing::bearing_rad,
             "Counter-clockwise from the sensor's x axis [rad].");
  finish_value(range, {"stamp_ns", "landmark", "range_m", "bearing_rad"});
  def_keyword_init(range);

  py::class_<LaserScan> scan(m, "LaserScan", "One scan of a planar lidar.");
  def_stamp(scan);
  def_number(scan, "angle_min_rad", &LaserScan::angle_min_rad, "Direction of the first ray [rad].");
  def_number(scan, "angle_increment_rad", &LaserScan::angle_increment_rad, "Angle between rays [rad].");
  def_number(scan, "time_increment_s", &LaserScan::time_increment_s, "Time between rays [s].");
  def_number(scan, "range_min_m", &LaserScan::range_min_m, "[m]");
  scan.def_property(
      "range_max_m", [](const LaserScan& s) { return s.range_max_m; },
      [](LaserScan& s, double range_m) {
        if (std::isnan(range_m)) refuse("range_max_m", "not a number", "Pass metres, or inf.");
        s.range_max_m = static_cast<decltype(s.range_max_m)>(range_m);
      },
      "[m]; infinite if unknown.");
  scan.def_property(
      "ranges_m",
      [](const LaserScan& s) {
        return py::array_t<float>(static_cast<py::ssize_t>(s.ranges_m.size()), s.ranges_m.data());
      },
      [](LaserScan& s, const py::object& ranges) {
        const Doubles given = doubles(ranges, "ranges_m", {-1}, Numbers::Any);
        s.ranges_m.resize(static_cast<std::size_t>(given.size()));
        std::transform(given.data(), given.data() + given.size(), s.ranges_m.begin(),
                       [](double r) { return static_cast<float>(r); });
      },
      "(rays,) float32 [m]; infinite if nothing is in range.");
  finish_value(scan, {"stamp_ns", "angle_min_rad", "angle_increment_rad", "time_increment_s", "range_min_m",
                      "range_max_m", "ranges_m"});
  def_keyword_init(scan);

  py::class_<GamepadState> pad(m, "GamepadState", "Sticks and buttons of a gamepad.");
  def_stamp(pad);
  pad.def_readwrite("axes", &GamepadState::axes, "-1 to 1 (a copy).");
  pad.def_readwrite("buttons", &GamepadState::buttons, "1 if pressed (a copy).");
  finish_value(pad, {"stamp_ns", "axes", "buttons"});
  def_keyword_init(pad);
}

}  // namespace

void bind_samples(py::module_& m) {
  m.doc() =
      "Sensor samples: plain values with a stamp in nanoseconds on the sensor clock. All are constructed "
      "with keywords, and can be compared, copied and pickled.";
  bind_detection(m);
  bind_camera_samples(m);
  bind_motion_samples(m);
  bind_other_samples(m);
}

}  // namespace waymark::python
