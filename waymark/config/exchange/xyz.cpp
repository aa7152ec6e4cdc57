#include "waymark/config/exchange/xyz.hpp"

#include <array>

#include <fmt/format.h>

#include "waymark/config/yaml_fields.hpp"

namespace waymark {

Result<Eigen::Vector3d> read_xyz(const YamlCursor& at) {
  Eigen::Vector3d v;
  const std::array<const char*, 3> axes = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) {
    const Result<double> number = at.read_at(axes[static_cast<std::size_t>(i)], &YamlCursor::number);
    if (!number) return tl::unexpected(number.error());
    v[i] = *number;
  }
  return v;
}

std::string xyz_lines(const char* key, const Eigen::Vector3d& v, const std::string& indent) {
  return fmt::format("{0}{1}:\n{0}  x: {2}\n{0}  y: {3}\n{0}  z: {4}\n", indent, key, yaml_number(v.x()),
                     yaml_number(v.y()), yaml_number(v.z()));
}

}  // namespace waymark
