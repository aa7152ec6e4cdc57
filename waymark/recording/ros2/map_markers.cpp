#include "waymark/recording/ros2/map_markers.hpp"

#include <string>
#include <utility>

#include "waymark/geometry/dense.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/recording/ros2/convert.hpp"

namespace waymark {
namespace {

ros2::Marker marker(std::string group, std::int32_t id, std::int32_t type) {
  ros2::Marker marker;
  marker.header.frame_id = std::string(ros2::kMapFrame);
  marker.ns = std::move(group);
  marker.id = id;
  marker.type = type;
  marker.pose.orientation.w = 1;
  return marker;
}

constexpr double kThickness_m = 0.002;

/// A white sheet, used in maps with too many tags to send all cells.
ros2::Marker blank(const MappedTag& tag, std::int32_t number) {
  ros2::Marker shape = marker("tags", number, ros2::Marker::kCube);
  shape.pose = ros2::to_ros(tag.map_T_tag);
  shape.scale = {.x = tag.size_m, .y = tag.size_m, .z = kThickness_m};
  shape.color = {.r = 1, .g = 1, .b = 1, .a = 1};
  return shape;
}

/// Thin boxes, one per cell, in the tag frame (x right, y down).
ros2::Marker printed(const TagId& id, const MappedTag& tag, std::int32_t number) {
  const Family& layout = family(id.family);
  const double cell_m = tag.size_m / layout.width_at_border;
  ros2::Marker shape = blank(tag, number);
  shape.type = ros2::Marker::kCubeList;
  shape.scale.x = shape.scale.y = cell_m;
  const std::vector<std::uint8_t> cells = bitmap(id);  // row by row
  std::size_t at = 0;
  for (int row = 0; row < layout.total_width; ++row) {
    for (int column = 0; column < layout.total_width; ++column) {
      const std::uint8_t cell = cells[at++];
      if (cell != 0 && cell != 255) continue;  // cells outside the tag
      const double middle = 0.5 * (layout.total_width - 1);
      shape.points.push_back({.x = (column - middle) * cell_m, .y = (row - middle) * cell_m, .z = 0});
      const float grey = cell == 0 ? 0.0F : 1.0F;
      shape.colors.push_back({.r = grey, .g = grey, .b = grey, .a = 1});
    }
  }
  return shape;
}

ros2::Marker label(const TagId& id, const MappedTag& tag, std::int32_t number) {
  ros2::Marker shape = marker("numbers", number, ros2::Marker::kText);
  const Eigen::Vector3d centre = tag.map_T_tag.translation();
  shape.pose.position = {.x = centre.x(), .y = centre.y(), .z = centre.z() + tag.size_m};
  shape.scale.z = tag.size_m * 0.6;  // height of the letters
  shape.color = {.r = 0.3F, .g = 0.3F, .b = 0.3F, .a = 1};
  shape.text = std::to_string(id.number);
  return shape;
}

/// The uncertainty of the tag centre: three standard deviations along each axis of the ellipsoid.
ros2::Marker ellipsoid(const MappedTag& tag, std::int32_t number) {
  constexpr double kDeviations = 3;
  constexpr double kThinnest_m = 1e-4;  // viewers do not draw flat shapes
  const Eigen::Matrix3d P =
      coordinate_covariance(Uncertain<SE3>{tag.map_T_tag, *tag.covariance}).topLeftCorner<3, 3>();
  const SymmetricEigen<3> axes = symmetric_eigen<3>(P);
  Eigen::Matrix3d map_R_axes = axes.vectors;
  if (map_R_axes.determinant() < 0) map_R_axes.col(0) *= -1;
  const Eigen::Vector3d size_m =
      (2 * kDeviations * axes.values.cwiseMax(0).cwiseSqrt()).cwiseMax(kThinnest_m);
  ros2::Marker shape = marker("uncertainty", number, ros2::Marker::kSphere);
  shape.pose = ros2::to_ros(SE3(SO3::from_matrix(map_R_axes), tag.map_T_tag.translation()));
  shape.scale = {.x = size_m.x(), .y = size_m.y(), .z = size_m.z()};
  shape.color = {.r = 0.8F, .g = 0, .b = 0, .a = 0.4F};
  return shape;
}

ros2::Marker line(const Route& route) {
  constexpr double kWidth_m = 0.02;
  ros2::Marker shape = marker("route", 0, ros2::Marker::kLineStrip);
  shape.scale.x = kWidth_m;
  shape.color = {.r = 0.32F, .g = 0.35F, .b = 0.4F, .a = 1};
  for (const RoutePoint& point : route.points)
    shape.points.push_back(
        {.x = point.map_T_base.translation().x(), .y = point.map_T_base.translation().y()});
  if (route.closed) shape.points.push_back(shape.points.front());
  return shape;
}

}  // namespace

ros2::MarkerArray map_markers(const TagMap& map, const Route& route) {
  constexpr std::int32_t kDeleteAll = 3;
  constexpr std::size_t kMaxPrinted = 300;
  ros2::MarkerArray all;
  all.markers.push_back(marker("", 0, ros2::Marker::kArrow));
  all.markers.back().action = kDeleteAll;
  std::int32_t number = 0;
  for (const auto& [id, tag] : map.tags) {
    all.markers.push_back(map.tags.size() > kMaxPrinted ? blank(tag, number) : printed(id, tag, number));
    all.markers.push_back(label(id, tag, number));
    if (tag.covariance && map.tags.size() <= kMaxPrinted) all.markers.push_back(ellipsoid(tag, number));
    ++number;
  }
  if (!route.points.empty()) all.markers.push_back(line(route));
  return all;
}

}  // namespace waymark
