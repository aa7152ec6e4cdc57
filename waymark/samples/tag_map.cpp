#include "waymark/samples/tag_map.hpp"
#include "waymark/geometry/dense.hpp"

#include <set>

#include <Eigen/Geometry>

namespace waymark {

SE3 map_T_floor(const FloorPlane& floor) {
  const auto map_q_floor = rotation_between(Eigen::Vector3d::UnitZ(), floor.normal);
  return {SO3::from_quaternion(map_q_floor), Eigen::Vector3d(0, 0, floor.z_m)};
}

std::vector<std::string> families_of(const TagMap& map) {
  std::set<std::string> families;
  for (const auto& [id, tag] : map.tags) families.emplace(to_string(id.family));
  return {families.begin(), families.end()};
}

}  // namespace waymark
