#include "python/bindings/states.hpp"

#include <optional>
#include <string>

#include <pybind11/stl.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/tag_ids.hpp"

namespace waymark::python {
namespace {

template <int N>
py::object array_or_none(const std::optional<Eigen::Matrix<double, N, N>>& matrix) {
  return matrix ? py::object(to_array(*matrix)) : py::object(py::none());
}

template <int N>
std::optional<Eigen::Matrix<double, N, N>> matrix_or_nothing(const py::handle& value) {
  if (value.is_none()) return std::nullopt;
  return matrix_of<N, N>(value, "covariance");
}

}  // namespace

py::tuple state_of(const TagMap& map) {
  py::list tags;
  for (const auto& [id, there] : map.tags) tags.append(py::make_tuple(to_string(id), there));
  return py::make_tuple(tags, map.floor.z_m, to_array(map.floor.normal),
                        array_or_none<3>(map.floor.covariance));
}

void from_state(const py::tuple& state, TagMap& map) {
  for (const py::handle& entry : py::cast<py::list>(state[0])) {
    const auto pair = py::cast<py::tuple>(entry);
    map.tags[tag_of(pair[0])] = py::cast<MappedTag>(pair[1]);
  }
  map.floor = {py::cast<double>(state[1]), matrix_of<3, 1>(state[2], "normal"),
               matrix_or_nothing<3>(state[3])};
}

py::tuple state_of(const Route& route) {
  py::list points;
  for (const RoutePoint& p : route.points)
    points.append(py::make_tuple(p.map_T_base, p.arc_length_m, p.curvature_1_m, p.speed_m_s));
  py::list tags;
  for (const RouteTag& tag : route.map_tags)
    tags.append(py::make_tuple(to_string(tag.tag), tag.x_m, tag.y_m));
  py::list stations;
  for (const Station& station : route.stations)
    stations.append(py::make_tuple(station.name, station.arc_length_m, station.pause_s));
  return py::make_tuple(points, route.closed, route.length_m, route.longest_without_tags_m, tags, stations);
}

void from_state(const py::tuple& state, Route& route) {
  for (const py::handle& entry : py::cast<py::list>(state[0])) {
    const auto p = py::cast<py::tuple>(entry);
    route.points.push_back(
        {py::cast<SE2>(p[0]), py::cast<double>(p[1]), py::cast<double>(p[2]), py::cast<double>(p[3])});
  }
  route.closed = py::cast<bool>(state[1]);
  route.length_m = py::cast<double>(state[2]);
  route.longest_without_tags_m = py::cast<std::optional<double>>(state[3]);
  for (const py::handle& entry : py::cast<py::list>(state[4])) {
    const auto tag = py::cast<py::tuple>(entry);
    route.map_tags.push_back({tag_of(tag[0]), py::cast<double>(tag[1]), py::cast<double>(tag[2])});
  }
  for (const py::handle& entry : py::cast<py::list>(state[5])) {
    const auto station = py::cast<py::tuple>(entry);
    route.stations.push_back(
        {py::cast<std::string>(station[0]), py::cast<double>(station[1]), py::cast<double>(station[2])});
  }
}

py::tuple state_of(const TagPoseSolution& solution) {
  return py::make_tuple(solution.cam_T_tag, solution.chi2, solution.rms_px, to_array(solution.covariance),
                        solution.sigma_scale, to_array(solution.lens_covariance));
}

void from_state(const py::tuple& state, TagPoseSolution& solution) {
  solution = {.cam_T_tag = py::cast<SE3>(state[0]),
              .chi2 = py::cast<double>(state[1]),
              .rms_px = py::cast<double>(state[2]),
              .covariance = matrix_of<6, 6>(state[3], "covariance"),
              .lens_covariance = matrix_of<6, 6>(state[5], "lens_covariance"),
              .sigma_scale = py::cast<double>(state[4])};
}

py::tuple state_of(const TagPose& pose) {
  return py::make_tuple(pose.best, pose.other, static_cast<int>(pose.other_state));
}

void from_state(const py::tuple& state, TagPose& pose) {
  pose.best = py::cast<TagPoseSolution>(state[0]);
  pose.other = py::cast<std::optional<TagPoseSolution>>(state[1]);
  pose.other_state = static_cast<OtherSolution>(py::cast<int>(state[2]));
}

py::tuple state_of(const CameraPoseEstimate& estimate) {
  return py::make_tuple(estimate.map_T_cam, to_array(estimate.covariance), estimate.chi2, estimate.rms_px,
                        estimate.detections);
}

void from_state(const py::tuple& state, CameraPoseEstimate& estimate) {
  estimate = {py::cast<SE3>(state[0]), matrix_of<6, 6>(state[1], "covariance"), py::cast<double>(state[2]),
              py::cast<double>(state[3]), py::cast<std::vector<std::size_t>>(state[4])};
}

py::tuple state_of(const LocalizationEstimate& estimate) {
  return py::make_tuple(estimate.stamp.time_since_epoch().count(), estimate.map_T_base,
                        to_array(estimate.covariance), estimate.certain, estimate.contradicting_frames);
}

void from_state(const py::tuple& state, LocalizationEstimate& estimate) {
  estimate.stamp = SensorTime(Duration(py::cast<std::int64_t>(state[0])));
  estimate.map_T_base = py::cast<SE2>(state[1]);
  estimate.covariance = matrix_of<3, 3>(state[2], "covariance");
  estimate.certain = py::cast<bool>(state[3]);
  estimate.contradicting_frames = py::cast<int>(state[4]);
}

}  // namespace waymark::python
