#include <limits>
#include <string>
#include <variant>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/rooms.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/yaml/calibration_file.hpp"

namespace waymark::python {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <std::size_t N>
std::array<double, N> coefficients_of(const std::vector<double>& given) {
  std::array<double, N> k{};
  if (given.size() > N)
    refuse("distortion",
           fmt::format("{} coefficients are given, but at most {} are allowed", given.size(), N));
  std::copy(given.begin(), given.end(), k.begin());
  return k;
}

CameraModel pinhole(int width, int height, double fx, double fy, double cx, double cy,
                    const std::vector<double>& k) {
  const PinholeRadtan lens{fx, fy, cx, cy, coefficients_of<8>(k), static_cast<int>(k.size())};
  return value_of(CameraModel::make(lens, width, height));
}

CameraModel fisheye(int width, int height, double fx, double fy, double cx, double cy,
                    const std::vector<double>& k) {
  return value_of(CameraModel::make(Equidistant{fx, fy, cx, cy, coefficients_of<4>(k)}, width, height));
}

py::array_t<double> project(const CameraModel& camera, const py::object& points) {
  return each_row(points, "cam_p", 3, 2, [&](const double* in, double* out) {
    const auto px = camera.project(Eigen::Vector3d(in[0], in[1], in[2]));
    Eigen::Map<Eigen::Vector2d>{out} = px ? *px : Eigen::Vector2d(kNaN, kNaN);
  });
}

py::array_t<double> unproject(const CameraModel& camera, const py::object& pixels) {
  return each_row(pixels, "px", 2, 3, [&](const double* in, double* out) {
    const auto bearing = camera.unproject(Eigen::Vector2d(in[0], in[1]));
    Eigen::Map<Eigen::Vector3d>{out} = bearing ? *bearing : Eigen::Vector3d(kNaN, kNaN, kNaN);
  });
}

py::object project_jacobian(const CameraModel& camera, const py::object& point) {
  Matrix23 J_px_p;
  if (!camera.project(matrix_of<3, 1>(point, "cam_p"), &J_px_p)) return py::none();
  return to_array(J_px_p);
}

std::string yaml_of(const CameraModel& camera) {
  return to_camera_info_yaml({.name = "cam", .camera = camera});
}

std::string repr_of(const CameraModel& camera) {
  std::string text;
  const Eigen::VectorXd numbers = intrinsics_of(camera);
  const auto names = intrinsics_names(camera);
  for (std::size_t i = 0; i < names.size(); ++i)
    text += fmt::format(", {}={:.6g}", names[i], numbers[static_cast<Eigen::Index>(i)]);
  const bool is_fisheye = std::holds_alternative<Equidistant>(camera.projection());
  return fmt::format("CameraModel({}, {}x{}{})", is_fisheye ? "fisheye" : "pinhole", camera.width_px(),
                     camera.height_px(), text);
}

}  // namespace

void bind_camera(py::module_& m) {
  m.doc() =
      "Camera models. Pixel (i, j) covers [i, i + 1) x [j, j + 1). Its centre is at (i + 1/2, j + 1/2), half "
      "a pixel more than in OpenCV and ROS. Camera frame: x right, y down, z forward [m].";
  py::class_<CameraModel> camera(
      m, "CameraModel",
      "A lens model and an image size; immutable. Created by pinhole(), fisheye() or read_camera().");
  camera.def_property_readonly("width_px", &CameraModel::width_px, "Image width [px].");
  camera.def_property_readonly("height_px", &CameraModel::height_px, "Image height [px].");
  camera.def_property_readonly("max_angle_rad", &CameraModel::max_angle_rad,
                               "Half the opening angle of the viewing cone [rad].");
  camera.def_property_readonly(
      "intrinsics", [](const CameraModel& c) { return to_array(intrinsics_of(c)); },
      "fx, fy, cx, cy [px], then the distortion coefficients in use, shape (n,).");
  camera.def_property_readonly(
      "intrinsics_names", [](const CameraModel& c) { return intrinsics_names(c); },
      "Names of the entries of `intrinsics`, in the same order: fx, fy, cx, cy, k1 …");
  camera.def_property_readonly(
      "matrix",
      [](const CameraModel& c) {
        const Eigen::VectorXd k = intrinsics_of(c);
        const double skew = std::visit([](const auto& lens) { return lens.skew; }, c.projection());
        return to_array((Eigen::Matrix3d() << k[0], skew, k[2], 0, k[1], k[3], 0, 0, 1).finished());
      },
      "The camera matrix K (3, 3), with pixel centres at + 1/2.");
  camera.def(
      "scaled",
      [](const CameraModel& c, int width_px, int height_px) {
        return value_of(scaled_camera(c, width_px, height_px));
      },
      py::arg("width_px"), py::arg("height_px"),
      "The camera for images scaled to a different size, with the same field of view. Raises ValueError if "
      "the aspect ratio differs by more than 1 %.");
  camera.def("project", &project, py::arg("cam_p"),
             "Pixels (2,) or (rows, 2) of points (3,) or (rows, 3) [m] in the camera frame; NaN for points "
             "outside the field of view of the lens.");
  camera.def(
      "unproject", &unproject, py::arg("px"),
      "Unit bearings (3,) or (rows, 3) of pixels (2,) or (rows, 2); NaN if no point projects to the pixel.");
  camera.def("project_jacobian", &project_jacobian, py::arg("cam_p"),
             "Derivative (2, 3) [px/m] of the pixel with respect to a point (3,); None if the point does not "
             "project.");
  camera.def(
      "contains",
      [](const CameraModel& c, const py::object& px) { return c.contains(matrix_of<2, 1>(px, "px")); },
      py::arg("px"), "Whether the pixel (2,) is inside the image.");
  camera.def(
      "with_intrinsics",
      [](const CameraModel& c, const py::object& numbers) {
        const Doubles given = doubles(numbers, "intrinsics", {intrinsics_of(c).size()});
        return value_of(with_intrinsics(c, Eigen::Map<const Eigen::VectorXd>(given.data(), given.size())));
      },
      py::arg("intrinsics"),
      "The same camera model with different parameters, in the order of `intrinsics`.");
  camera.def("to_yaml", &yaml_of, "ROS camera_info YAML, in which pixel centres are at integer coordinates.");
  camera.def(
      "__eq__", [](const CameraModel& a, const CameraModel& b) { return a == b; }, py::is_operator());
  camera.def("__repr__", &repr_of);
  camera.def(py::pickle([](const CameraModel& c) { return py::make_tuple(yaml_of(c)); },
                        [](const py::tuple& state) {
                          return value_of(parse_camera(py::cast<std::string>(state[0]), "pickle")).camera;
                        }));

  const char* const kArguments = "fx, fy, cx, cy in pixels, with pixel centres at + 1/2. ";
  m.def("pinhole", &pinhole, py::arg("width_px"), py::arg("height_px"), py::arg("fx"), py::arg("fy"),
        py::arg("cx"), py::arg("cy"), py::arg("distortion") = std::vector<double>{},
        (std::string("Pinhole; ") + kArguments +
         "distortion: empty, or k1 k2 p1 p2 [k3 [k4 k5 k6]] in the order of OpenCV.")
            .c_str());
  m.def("fisheye", &fisheye, py::arg("width_px"), py::arg("height_px"), py::arg("fx"), py::arg("fy"),
        py::arg("cx"), py::arg("cy"), py::arg("distortion") = std::vector<double>{0, 0, 0, 0},
        (std::string("Equidistant fisheye (Kannala and Brandt, 2006); ") + kArguments +
         "distortion: k1 k2 k3 k4.")
            .c_str());
  m.def(
      "read_camera",
      [](const std::filesystem::path& path, const std::string& name) {
        return value_of(read_camera(path, name)).camera;
      },
      py::arg("path"), py::arg("name") = "",
      "Reads a camera from a file: ROS camera_info, kalibr camchain, robot.yaml, calibration.yaml, "
      "PhotonVision. If the file contains several cameras, pass the `name` of one.");
  m.def(
      "read_intrinsics_covariance",
      [](const std::filesystem::path& path) -> py::object {
        const Calibration calibration = value_of(read_calibration(path));
        const auto covariance = calibration.camera ? intrinsics_covariance(*calibration.camera, calibration)
                                                   : IntrinsicsCovariance();
        if (covariance.size() == 0) return py::none();
        return to_array(covariance);
      },
      py::arg("path"),
      "Covariance (n, n) of CameraModel.intrinsics from a calibration.yaml; None if the file contains no "
      "standard deviations of them.");
  m.def(
      "parse_camera",
      [](const std::string& text, const std::string& source) {
        return value_of(parse_camera(text, source)).camera;
      },
      py::arg("text"), py::arg("source") = "text", "Like read_camera(), but from the text of such a file.");
}

}  // namespace waymark::python
