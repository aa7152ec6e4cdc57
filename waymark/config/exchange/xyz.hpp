#pragma once

#include <string>

#include <Eigen/Core>

#include "waymark/config/yaml_tree.hpp"

namespace waymark {

/// A vector with the keys x, y and z, as written by TagSLAM, ROS and WPILib.
[[nodiscard]] Result<Eigen::Vector3d> read_xyz(const YamlCursor& at);
/// Writes the vector as YAML lines under `key`.
[[nodiscard]] std::string xyz_lines(const char* key, const Eigen::Vector3d& v, const std::string& indent);

}  // namespace waymark
