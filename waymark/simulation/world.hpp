#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// A place with tags and a line to drive. Frame map: z up, floor at z = 0.
struct World {
  std::string name{};
  TagMap tags{};
  TagId anchor{};                         ///< the tag whose pose is known beforehand
  std::vector<Eigen::Vector2d> path_m{};  ///< points of a smooth line a driver follows
  bool path_closed = true;
};

/// The pose of an upright tag: centre at (x, y, z), `facing_rad` the direction from the tag to its reader,
/// from map x to map y.
[[nodiscard]] SE3 upright_tag(const Eigen::Vector3d& map_t_tag, double facing_rad);

}  // namespace waymark
