#include "waymark/config/world_robot.hpp"

#include "waymark/config/world_scenery.hpp"
#include "waymark/config/yaml_cursor.hpp"

namespace waymark {

Result<std::string> robot_of_world(std::string_view text, const std::string& source) {
  const Result<YamlNode> tree = parse_yaml(text, source, internal::kWorldLimits);
  if (!tree) return tl::unexpected(tree.error());
  const auto robot = YamlCursor(*tree, source).find("robot");
  return robot ? robot->text() : std::string();
}

}  // namespace waymark
