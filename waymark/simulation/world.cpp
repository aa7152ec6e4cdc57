#include "waymark/simulation/world.hpp"

#include <cmath>

namespace waymark {

SE3 upright_tag(const Eigen::Vector3d& map_t_tag, double facing_rad) {
  const Eigen::Vector3d to_reader(std::cos(facing_rad), std::sin(facing_rad), 0);
  Eigen::Matrix3d map_R_tag;
  map_R_tag.col(2) = -to_reader;                                // z into the tag
  map_R_tag.col(1) = -Eigen::Vector3d::UnitZ();                 // y down
  map_R_tag.col(0) = map_R_tag.col(1).cross(map_R_tag.col(2));  // x right, as its reader sees it
  return {SO3::from_matrix(map_R_tag), map_t_tag};
}

}  // namespace waymark
