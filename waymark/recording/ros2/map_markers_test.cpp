#include "waymark/recording/ros2/map_markers.hpp"

#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include "waymark/geometry/uncertainty.hpp"
#include "waymark/recording/ros2/convert.hpp"

namespace waymark {
namespace {

TagMap one_tag() {
  TagMap map;
  const SE3 map_T_tag(SO3::exp({0.3, -0.2, 0.9}), Eigen::Vector3d(1, 2, 0.4));
  map.tags[{FamilyId::Tag36h11, 7}] = {.map_T_tag = map_T_tag, .size_m = 0.16};
  return map;
}

TEST(MapMarkers, DrawsATagAsPrinted) {
  const ros2::MarkerArray all = map_markers(one_tag(), {});
  ASSERT_EQ(all.markers.size(), 3u);
  EXPECT_EQ(all.markers[0].action, 3);  // deletes all earlier markers
  const ros2::Marker& tag = all.markers[1];
  EXPECT_EQ(tag.type, ros2::Marker::kCubeList);
  ASSERT_EQ(tag.points.size(), 100u);  // 10 x 10 cells, including the white margin
  ASSERT_EQ(tag.colors.size(), 100u);
  const auto cells = bitmap({FamilyId::Tag36h11, 7});
  for (std::size_t i = 0; i < cells.size(); ++i) EXPECT_EQ(tag.colors[i].r, cells[i] == 0 ? 0.0F : 1.0F);
  // The black square has the size of the tag, so the outermost black cell ends at half the size from the
  // centre.
  double reach = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (tag.colors[i].r == 0.0F)
      reach = std::max({reach, std::abs(tag.points[i].x), std::abs(tag.points[i].y)});
  }
  EXPECT_NEAR(reach + tag.scale.x / 2, 0.08, 1e-12);
  EXPECT_LT(tag.points[0].x, 0);  // the first cell is at the top left
  EXPECT_LT(tag.points[0].y, 0);  // y down
  const SE3 drawn = ros2::from_ros(tag.pose);
  EXPECT_NEAR((drawn.translation() - Eigen::Vector3d(1, 2, 0.4)).norm(), 0, 1e-12);
  EXPECT_EQ(all.markers[2].text, "7");
  EXPECT_NEAR(all.markers[2].pose.position.z, 0.56, 1e-12);
}

TEST(MapMarkers, DoesNotDrawCellsOutsideTheTag) {
  TagMap map;
  map.tags[{FamilyId::TagCircle21h7, 3}] = {.size_m = 0.1};
  const auto cells = bitmap({FamilyId::TagCircle21h7, 3});
  const auto printed = std::ranges::count_if(cells, [](std::uint8_t c) { return c == 0 || c == 255; });
  ASSERT_LT(printed, static_cast<std::ptrdiff_t>(cells.size()));
  EXPECT_EQ(map_markers(map, {}).markers[1].points.size(), static_cast<std::size_t>(printed));
}

TEST(MapMarkers, DrawsUncertaintyAsAThreeSigmaEllipsoid) {
  TagMap map = one_tag();
  MappedTag& tag = map.tags.begin()->second;
  const SO3 map_R_axes = SO3::exp({0.2, 0.4, -0.7});
  const Eigen::Vector3d deviations_m(0.001, 0.02, 0.005);
  Eigen::Matrix<double, 6, 6> P = Eigen::Matrix<double, 6, 6>::Identity() * 1e-4;
  P.topLeftCorner<3, 3>() =
      map_R_axes.matrix() * deviations_m.cwiseAbs2().asDiagonal() * map_R_axes.matrix().transpose();
  tag.covariance = from_coordinate_covariance(tag.map_T_tag, P).covariance;
  const ros2::MarkerArray all = map_markers(map, {});
  ASSERT_EQ(all.markers.size(), 4u);
  const ros2::Marker& shape = all.markers.back();
  EXPECT_EQ(shape.type, ros2::Marker::kSphere);
  const SE3 pose = ros2::from_ros(shape.pose);
  EXPECT_NEAR((pose.translation() - tag.map_T_tag.translation()).norm(), 0, 1e-12);
  const Eigen::Vector3d half_m(shape.scale.x / 6, shape.scale.y / 6, shape.scale.z / 6);
  const Eigen::Matrix3d drawn =
      pose.rotation().matrix() * half_m.cwiseAbs2().asDiagonal() * pose.rotation().matrix().transpose();
  EXPECT_LT((drawn - P.topLeftCorner<3, 3>()).norm(), 1e-12);
}

TEST(MapMarkers, DrawsARouteAsALineClosedIfTheRouteIs) {
  Route route{
      .points = {{.map_T_base = SE2(0, 0, 0)}, {.map_T_base = SE2(1, 0, 1)}, {.map_T_base = SE2(1, 1, 2)}}};
  EXPECT_EQ(map_markers({}, route).markers.back().points.size(), 3u);
  route.closed = true;
  const ros2::Marker line = map_markers({}, route).markers.back();
  ASSERT_EQ(line.points.size(), 4u);
  EXPECT_EQ(line.type, ros2::Marker::kLineStrip);
  EXPECT_EQ(line.points.back().x, 0);
  EXPECT_EQ(line.points[2].y, 1);
}

}  // namespace
}  // namespace waymark
