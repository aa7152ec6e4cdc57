#include <optional>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/rooms.hpp"
#include "python/bindings/states.hpp"
#include "python/bindings/tag_ids.hpp"
#include "python/bindings/trajectories.hpp"
#include "python/bindings/values.hpp"
#include "waymark/samples/route.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark::python {
namespace {

PoseList poses_of(const py::object& stamps, const py::object& matrices, const py::object& covariances) {
  const auto ns = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>::ensure(stamps);
  if (!ns || ns.ndim() != 1) {
    PyErr_Clear();
    refuse("stamps_ns", "not an array of integers", "Pass an array (n,) of int64 nanoseconds.");
  }
  const py::ssize_t n = ns.shape(0);
  const Doubles poses = doubles(matrices, "map_T_base", {n, 4, 4});
  PoseList list;
  for (py::ssize_t i = 0; i < n; ++i) {
    if (i > 0 && ns.at(i) <= ns.at(i - 1)) refuse("stamps_ns", "the stamps are not strictly increasing");
    const Eigen::Matrix4d pose =
        Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(poses.data(i));
    list.poses.push_back({SensorTime(Duration(ns.at(i))), value_of(SE3::try_from_matrix(pose)), {}});
  }
  if (covariances.is_none()) return list;
  const Doubles P = doubles(covariances, "covariance", {n, 3, 3});
  for (py::ssize_t i = 0; i < n; ++i)
    list.poses[static_cast<std::size_t>(i)].covariance =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(P.data(i));
  return list;
}

/// The exact state for pickle: (stamp, SE3, covariance or None) for each pose.
py::list poses_state(const PoseList& list) {
  py::list state;
  for (const EstimatedPose& pose : list.poses)
    state.append(py::make_tuple(pose.stamp.time_since_epoch().count(), pose.map_T_base,
                                pose.covariance ? to_array(*pose.covariance) : py::object(py::none())));
  return state;
}

PoseList from_poses_state(const py::list& state) {
  PoseList list;
  for (const py::handle& entry : state) {
    const auto pose = py::cast<py::tuple>(entry);
    list.poses.push_back({SensorTime(Duration(py::cast<std::int64_t>(pose[0]))), py::cast<SE3>(pose[1]), {}});
    if (!pose[2].is_none()) list.poses.back().covariance = matrix_of<3, 3>(pose[2], "covariance");
  }
  return list;
}

/// One row per pose: `fill(pose, row)` writes `width` values.
template <class Fill>
py::array_t<double> rows_of(const PoseList& list, const std::vector<py::ssize_t>& shape, Fill&& fill) {
  std::vector<py::ssize_t> all{static_cast<py::ssize_t>(list.poses.size())};
  all.insert(all.end(), shape.begin(), shape.end());
  py::array_t<double> array(all);
  const py::ssize_t width = list.poses.empty() ? 0 : array.size() / array.shape(0);
  double* row = array.mutable_data();
  for (const EstimatedPose& pose : list.poses) {
    fill(pose, row);
    row += width;
  }
  return array;
}

py::object covariances_of(const PoseList& list) {
  for (const EstimatedPose& pose : list.poses)
    if (!pose.covariance) return py::none();
  return rows_of(list, {3, 3}, [](const EstimatedPose& pose, double* row) {
    Eigen::Map<Eigen::Matrix3d>{row} = *pose.covariance;
  });
}

void bind_trajectory(py::module_& m) {
  py::class_<PoseList> cls(m, "Trajectory", "Poses of the base in order of time.");
  cls.def(py::init(&poses_of), py::arg("stamps_ns"), py::arg("map_T_base"),
          py::arg("covariance") = py::none(),
          "From increasing stamps (n,) [ns], poses (n, 4, 4) and optional covariances (n, 3, 3) of x, y [m] "
          "and yaw [rad] in map coordinates.");
  cls.def("__len__", [](const PoseList& list) { return list.poses.size(); });
  cls.def_property_readonly(
      "stamps_ns",
      [](const PoseList& list) {
        py::array_t<std::int64_t> array(static_cast<py::ssize_t>(list.poses.size()));
        auto* to = array.mutable_data();
        for (const EstimatedPose& pose : list.poses) *to++ = pose.stamp.time_since_epoch().count();
        return array;
      },
      "(n,) int64 [ns]");
  cls.def_property_readonly(
      "map_T_base",
      [](const PoseList& list) {
        return rows_of(list, {4, 4}, [](const EstimatedPose& pose, double* row) {
          Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>{row} = pose.map_T_base.matrix();
        });
      },
      "Homogeneous matrices (n, 4, 4).");
  cls.def_property_readonly(
      "xy_yaw",
      [](const PoseList& list) {
        return rows_of(list, {3}, [](const EstimatedPose& pose, double* row) {
          row[0] = pose.map_T_base.translation().x();
          row[1] = pose.map_T_base.translation().y();
          row[2] = pose.map_T_base.rotation().rpy().z();
        });
      },
      "x, y [m] and yaw [rad], (n, 3).");
  cls.def_property_readonly(
      "covariance", &covariances_of,
      "Covariances of x, y [m] and yaw [rad] in map coordinates, (n, 3, 3); None if one is unknown.");
  cls.def("__repr__",
          [](const PoseList& list) { return fmt::format("Trajectory({} poses)", list.poses.size()); });
  cls.def(py::pickle(&poses_state, &from_poses_state));
  finish_state(cls);
}

void bind_tag_map(py::module_& m) {
  py::class_<MappedTag> tag(m, "MappedTag", "One tag of a map.");
  tag.def_readwrite("map_T_tag", &MappedTag::map_T_tag,
                    "SE3; tag frame: centre, x right, y down, z into the tag.");
  tag.def_property(
      "size_m", [](const MappedTag& t) { return t.size_m; },
      [](MappedTag& t, double size_m) {
        if (finite(size_m, "size_m") < 0) refuse("size_m", "the size is negative");
        t.size_m = size_m;
      },
      "Side of the square at the outer edge of the black border [m].");
  tag.def_property(
      "covariance",
      [](const MappedTag& t) -> py::object {
        return t.covariance ? to_array(*t.covariance) : py::object(py::none());
      },
      [](MappedTag& t, const py::object& P) {
        t.covariance.reset();
        if (!P.is_none()) t.covariance = matrix_of<6, 6>(P, "covariance");
      },
      "(6, 6) in the left tangent in the map frame (translation, rotation) [m, rad]; None if unknown.");
  finish_value(tag, {"map_T_tag", "size_m", "covariance"});
  def_keyword_init(tag);

  py::class_<TagMap> map(m, "TagMap",
                         "Tag poses: a mapping from names ('tag36h11:7') to MappedTag, in order of id.");
  map.def(py::init<>());
  map.def("__len__", [](const TagMap& tags) { return tags.tags.size(); });
  map.def(
      "__contains__",
      [](const TagMap& tags, const py::object& name) { return tags.find(tag_of(name)) != nullptr; },
      py::arg("tag"));
  map.def(
      "__getitem__",
      [](const TagMap& tags, const py::object& name) {
        const MappedTag* found = tags.find(tag_of(name));
        if (found == nullptr) throw py::key_error(to_string(tag_of(name)) + " is not in the map");
        return *found;
      },
      py::arg("tag"), "A copy of the tag; assign it to change the map.");
  map.def(
      "__setitem__",
      [](TagMap& tags, const py::object& name, const MappedTag& tag_there) {
        const TagId id = tag_of(name);
        if (!(tag_there.size_m > 0))
          refuse("size_m", to_string(id) + " has no size", "Pass MappedTag(map_T_tag=..., size_m=0.16).");
        tags.tags[id] = tag_there;
      },
      py::arg("tag"), py::arg("mapped"));
  map.def(
      "__delitem__",
      [](TagMap& tags, const py::object& name) {
        if (tags.tags.erase(tag_of(name)) == 0)
          throw py::key_error(to_string(tag_of(name)) + " is not in the map");
      },
      py::arg("tag"));
  map.def(
      "keys",
      [](const TagMap& tags) {
        std::vector<std::string> names;
        for (const auto& [id, there] : tags.tags) names.push_back(to_string(id));
        return names;
      },
      "Names of the tags, in order of id.");
  map.def("__iter__", [](const py::object& self) { return py::iter(self.attr("keys")()); });
  def_state(map);
  map.def("__repr__", [](const TagMap& tags) { return fmt::format("TagMap({} tags)", tags.tags.size()); });
}

void bind_route(py::module_& m) {
  py::class_<Route> route(m, "Route", "A path to drive.");
  route.def_readonly("closed", &Route::closed, "Whether the last point connects to the first.");
  route.def_readonly("length_m", &Route::length_m, "[m]");
  route.def("__len__", [](const Route& r) { return r.points.size(); });
  route.def_property_readonly(
      "points",
      [](const Route& r) {
        py::array_t<double> array({static_cast<py::ssize_t>(r.points.size()), py::ssize_t{6}});
        double* row = array.mutable_data();
        for (const RoutePoint& p : r.points)
          for (const double number : {p.map_T_base.x(), p.map_T_base.y(), p.map_T_base.yaw(), p.arc_length_m,
                                      p.curvature_1_m, p.speed_m_s})
            *row++ = number;
        return array;
      },
      "(n, 6): x, y [m], yaw [rad], arc length [m], curvature [1/m], speed [m/s].");
  def_state(route);
  route.def("__repr__", [](const Route& r) {
    return fmt::format("Route({} points, {:.2f} m)", r.points.size(), r.length_m);
  });
}

}  // namespace

void bind_maps(py::module_& m) {
  bind_trajectory(m);
  bind_tag_map(m);
  bind_route(m);
  m.def(
      "visible_corners",
      [](const CameraModel& camera, const SE3& cam_T_tag, double size_m) -> py::object {
        const auto px = visible_corners(camera, cam_T_tag, size_m);
        if (!px) return py::none();
        return py::array_t<double>({4, 2}, (*px)[0].data());
      },
      py::arg("camera"), py::arg("cam_T_tag"), py::arg("size_m"),
      "Corners TL, TR, BR, BL in the image, (4, 2) [px]; None if a detector would not find the tag from "
      "there.");
}

}  // namespace waymark::python
