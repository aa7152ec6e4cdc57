#include <algorithm>
#include <string>

#include <fmt/format.h>
#include <pybind11/pybind11.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/rooms.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark::python {
namespace {

template <class G>
typename G::Tangent tangent_of(const py::handle& xi) {
  return matrix_of<G::kDof, 1>(xi, "xi");
}

/// exp(xi); raises InvalidArgument if the result is not finite.
template <class G>
G exp_of(const py::object& xi) {
  const G X = G::exp(tangent_of<G>(xi));
  if (!X.matrix().allFinite()) refuse("xi", "exp() is not finite for such large values");
  return X;
}

/// Binds exp(), log() and the related operations of one group.
template <class G>
void def_lie(py::class_<G>& cls) {
  cls.def(py::init<>(), "The identity.");
  cls.def_static("identity", &G::identity, "The identity element.");
  cls.def_static("exp", &exp_of<G>, py::arg("xi"),
                 "The group element for a tangent (n,): translation [m], then rotation [rad], in the parent "
                 "frame. exp(xi) X is X moved by xi.");
  cls.def(
      "log", [](const G& X) { return to_array(X.log()); },
      "The tangent (n,): translation [m], then rotation [rad] with a norm of at most pi.");
  cls.def("inverse", &G::inverse, "b_T_a of a_T_b.");
  cls.def(
      "__matmul__", [](const G& a, const G& b) { return a * b; }, py::arg("b_T_c"), py::is_operator());
  cls.def(
      "__mul__", [](const G& a, const G& b) { return a * b; }, py::arg("b_T_c"), py::is_operator());
  cls.def(
      "matrix", [](const G& X) { return to_array(X.matrix()); }, "The homogeneous matrix (n, n).");
  cls.def(
      "__array__",
      [](const G& X, const py::object& dtype) -> py::object {
        const py::object matrix = to_array(X.matrix());
        return dtype.is_none() ? matrix : matrix.attr("astype")(dtype);
      },
      py::arg("dtype") = py::none());
  cls.def(
      "__eq__", [](const G& a, const G& b) { return a == b; }, py::is_operator());
  cls.def(
      "adjoint", [](const G& X) { return to_table(X.adjoint()); },
      "(n, n): X exp(xi) inverse(X) = exp(adjoint(X) xi).");
  cls.def_static(
      "hat", [](const py::object& xi) { return to_array(G::hat(tangent_of<G>(xi))); }, py::arg("xi"),
      "The Lie algebra matrix of a tangent.");
  cls.def_static(
      "vee",
      [](const py::object& m) { return to_array(G::vee(matrix_of<G::kMatrixSize, G::kMatrixSize>(m, "m"))); },
      py::arg("m"), "Inverse of hat().");
  cls.def_static(
      "left_jacobian", [](const py::object& xi) { return to_table(G::left_jacobian(tangent_of<G>(xi))); },
      py::arg("xi"), "(n, n): exp(xi + d) = exp(left_jacobian(xi) d) exp(xi) to first order in d.");
  cls.def_static(
      "right_jacobian", [](const py::object& xi) { return to_table(G::right_jacobian(tangent_of<G>(xi))); },
      py::arg("xi"), "(n, n): exp(xi + d) = exp(xi) exp(right_jacobian(xi) d) to first order in d.");
}

/// Refuses group elements, which NumPy would convert to the rows of their matrix.
void refuse_elements(const py::object& points, const char* group) {
  if (py::isinstance<SO2>(points) || py::isinstance<SO3>(points) || py::isinstance<SE2>(points) ||
      py::isinstance<SE3>(points) || py::isinstance<SE23>(points))
    throw py::type_error(fmt::format(
        "{} and {} are not from the same group. SE2.lift() returns an SE3, SE3.project_to_plane() returns an "
        "SE2, and SE3(R, [0, 0, 0]) is the rigid motion with rotation R",
        group, std::string(py::str(py::type::of(points).attr("__name__")))));
}

/// Transforms one point (n,) or many (rows, n).
template <class G>
void def_act(py::class_<G>& cls) {
  constexpr int kPoint = G::kPointSize;
  const auto act = [name = std::string(py::str(cls.attr("__name__")))](const G& X, const py::object& points) {
    refuse_elements(points, name.c_str());
    return each_row(points, "points", kPoint, kPoint, [&](const double* in, double* out) {
      using Point = typename G::Point;
      Eigen::Map<Point> result(out);
      result = X * Point(Eigen::Map<const Point>(in));
    });
  };
  cls.def("act", act, py::arg("points"),
          "Transforms points from frame b, shape (n,) or (rows, n) [m], to frame a.");
  cls.def("__matmul__", act, py::arg("points"), py::is_operator());
  cls.def("__mul__", act, py::arg("points"), py::is_operator());
}

template <class G>
void def_pickle(py::class_<G>& cls, py::bytes (*to_bytes)(const G&), G (*from_bytes)(const std::string&)) {
  cls.def(py::pickle([to_bytes](const G& X) { return to_bytes(X); },
                     [from_bytes](const py::bytes& state) { return from_bytes(state); }));
}

/// The exact bytes of a value.
template <class T>
py::bytes raw_bytes(const T& value) {
  return {reinterpret_cast<const char*>(&value), sizeof(T)};
}

template <class T>
T from_raw_bytes(const std::string& state) {
  T value;
  if (state.size() != sizeof(T)) refuse("state", "not a pickle of this class and version");
  std::copy(state.begin(), state.end(), reinterpret_cast<char*>(&value));
  return value;
}

template <class G>
void def_common(py::class_<G>& cls) {
  def_lie(cls);
  def_pickle<G>(cls, &raw_bytes<G>, &from_raw_bytes<G>);
}

std::string text_of(const Eigen::VectorXd& numbers) {
  std::string text;
  for (const double number : numbers) text += fmt::format("{}{:.6g}", text.empty() ? "" : ", ", number);
  return text;
}

SO3 from_quaternion(const py::object& xyzw) {
  const Eigen::Vector4d q = matrix_of<4, 1>(xyzw, "xyzw");
  return value_of(SO3::try_from_quaternion(Eigen::Quaterniond(q[3], q[0], q[1], q[2])));
}

void bind_rotations(py::module_& m) {
  py::class_<SO2> so2(m, "SO2", "A rotation in the plane, a_R_b. Tangent: the angle [rad], shape (1,).");
  so2.def(py::init([](double angle) { return SO2(finite(angle, "angle_rad")); }), py::arg("angle_rad"));
  so2.def_property_readonly("angle", &SO2::angle, "In (-pi, pi] [rad].");
  so2.def("__repr__", [](const SO2& R) { return fmt::format("SO2({:.6g})", R.angle()); });
  def_common(so2);
  def_act(so2);

  py::class_<SO3> so3(
      m, "SO3", "A rotation in space, a_R_b. Tangent: the rotation vector (3,) [rad] in the parent frame.");
  so3.def_static(
      "from_matrix",
      [](const py::object& a) { return value_of(SO3::try_from_matrix(matrix_of<3, 3>(a, "matrix"))); },
      py::arg("matrix"), "From a rotation matrix (3, 3). Raises InvalidArgument for any other matrix.");
  so3.def_static("from_quaternion", &from_quaternion, py::arg("xyzw"),
                 "From a unit quaternion (4,) in the order x, y, z, w.");
  so3.def_static(
      "from_rpy",
      [](double roll, double pitch, double yaw) {
        return SO3::from_rpy(finite(roll, "roll"), finite(pitch, "pitch"), finite(yaw, "yaw"));
      },
      py::arg("roll"), py::arg("pitch"), py::arg("yaw"), "R_z(yaw) R_y(pitch) R_x(roll) [rad] (REP 103).");
  so3.def(
      "rpy", [](const SO3& R) { return to_array(R.rpy()); }, "Roll, pitch, yaw (3,) [rad].");
  so3.def(
      "quaternion", [](const SO3& R) { return to_array(R.quaternion().coeffs()); },
      "Unit quaternion (4,) in the order x, y, z, w, with w >= 0.");
  so3.def("angle", &SO3::angle, "Rotation angle in [0, pi] [rad].");
  so3.def("__repr__", [](const SO3& R) { return "SO3(log=[" + text_of(R.log()) + "])"; });
  def_common(so3);
  def_act(so3);
}

void bind_motions(py::module_& m) {
  py::class_<SE2> se2(m, "SE2",
                      "A rigid motion in the plane, a_T_b: the pose of b in a. Tangent (3,): x, y [m], yaw "
                      "[rad] in the parent frame.");
  se2.def(py::init([](double x, double y, double yaw) {
            return SE2(finite(x, "x"), finite(y, "y"), finite(yaw, "yaw"));
          }),
          py::arg("x"), py::arg("y"), py::arg("yaw"));
  se2.def_property_readonly("x", &SE2::x, "[m]");
  se2.def_property_readonly("y", &SE2::y, "[m]");
  se2.def_property_readonly("yaw", &SE2::yaw, "In (-pi, pi] [rad].");
  se2.def_property_readonly(
      "rotation", [](const SE2& T) { return T.rotation(); }, "The rotation a_R_b, an SO2.");
  se2.def_property_readonly(
      "translation", [](const SE2& T) { return to_array(T.translation()); }, "(2,) [m]");
  se2.def("__repr__",
          [](const SE2& T) { return fmt::format("SE2({:.6g}, {:.6g}, {:.6g})", T.x(), T.y(), T.yaw()); });
  def_common(se2);
  def_act(se2);

  py::class_<SE3> se3(m, "SE3",
                      "A rigid motion in space, a_T_b: the pose of b in a. Tangent (6,): translation [m], "
                      "then rotation vector [rad], in the parent frame.");
  se3.def(
      py::init([](const SO3& R, const py::object& t) { return SE3(R, matrix_of<3, 1>(t, "translation")); }),
      py::arg("rotation"), py::arg("translation"));
  se3.def_static(
      "from_matrix",
      [](const py::object& a) { return value_of(SE3::try_from_matrix(matrix_of<4, 4>(a, "matrix"))); },
      py::arg("matrix"),
      "From a homogeneous matrix (4, 4); raises InvalidArgument if it is not a rigid motion.");
  se3.def_property_readonly(
      "rotation", [](const SE3& T) { return T.rotation(); }, "The rotation a_R_b, an SO3.");
  se3.def_property_readonly(
      "translation", [](const SE3& T) { return to_array(T.translation()); }, "(3,) [m]");
  se3.def(
      "project_to_plane", [](const SE3& T) { return project_to_plane(T); },
      "x, y and heading in the plane z = 0.");
  se2.def(
      "lift", [](const SE2& T) { return lift(T); }, "The same motion as an SE3 in the plane z = 0.");
  se3.def("__repr__", [](const SE3& T) {
    return "SE3(translation=[" + text_of(T.translation()) + "], rotation=[" + text_of(T.rotation().log()) +
           "])";
  });
  def_common(se3);
  def_act(se3);

  py::class_<SE23> se23(m, "SE23",
                        "Pose and velocity of a body. Tangent (9,): translation [m], velocity [m/s], "
                        "rotation [rad], in the parent frame.");
  se23.def("__repr__", [](const SE23& T) { return "SE23(log=[" + text_of(T.log()) + "])"; });
  def_common(se23);
}

}  // namespace

void bind_geometry(py::module_& m) {
  m.doc() =
      "Rotations and rigid motions with their Lie group operations (docs/concepts/geometry.md). a_T_b @ "
      "b_T_c is a_T_c; "
      "a_T_b @ points transforms points from b to a.";
  bind_rotations(m);
  bind_motions(m);
  m.def(
      "coordinate_covariance",
      [](const SE3& a_T_b, const py::object& P) {
        return to_array(coordinate_covariance(Uncertain<SE3>{a_T_b, matrix_of<6, 6>(P, "covariance")}));
      },
      py::arg("a_T_b"), py::arg("covariance"),
      "Covariance (6, 6) of the coordinates of b in a and of the rotation about the axes of a, from that of "
      "the left tangent.");
  m.def(
      "compose_covariance",
      [](const SE3& a_T_b, const py::object& P, const SE3& b_T_c, const py::object& Q) {
        return to_array(compose(Uncertain<SE3>{a_T_b, matrix_of<6, 6>(P, "covariance_ab")},
                                Uncertain<SE3>{b_T_c, matrix_of<6, 6>(Q, "covariance_bc")})
                            .covariance);
      },
      py::arg("a_T_b"), py::arg("covariance_ab"), py::arg("b_T_c"), py::arg("covariance_bc"),
      "Covariance (6, 6) of a_T_b @ b_T_c, in the left tangent of a, to first order; the two errors must be "
      "independent.");
}

}  // namespace waymark::python
