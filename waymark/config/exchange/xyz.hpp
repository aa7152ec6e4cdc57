#pragma once

#include <string>

#include <Eigen/Core>

#include "waymark/config/yaml_tree.hpp"

namespace waymark {

/// A vector with the keys x, y and z, as TagSLAM, ROS and WPILib write it.
[[nodiscard]] Result<Eigen::Vector3d> read_xyz(const YamlCursor& at);
/// The same as lines of YAML below `key`.
[[nodiscard]] std::string xyz_lines(const char* key, const Eigen::Vector3d& v, const std::string& indent);

}  // namespace waymark
