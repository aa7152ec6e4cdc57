#include "waymark/config/robot_motion_file.hpp"

#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_fields.hpp"

namespace waymark {

namespace {

constexpr YamlLimits kLimits{.bytes = std::size_t{1} << 18U, .nodes = 20'000, .depth = 16};

}  // namespace

Result<std::optional<MotionNoise>> parse_robot_motion(std::string_view text, const std::string& source) {
  const Result<YamlNode> tree = parse_yaml(text, source, kLimits);
  if (!tree) return tl::unexpected(tree.error());
  const auto motion = YamlCursor(*tree, source).find("motion");
  if (!motion) return std::optional<MotionNoise>();
  const Result<MotionNoise> noise = read_fields<MotionNoise>(*motion);
  if (!noise) return tl::unexpected(noise.error());
  if (const Status status = check_ranges(*noise); !status) {
    Error error = status.error();
    error.place = {.source = source, .line = motion->place().line, .key = "motion." + error.place.key};
    return tl::unexpected(error);
  }
  return std::optional<MotionNoise>(*noise);
}

Result<std::optional<MotionNoise>> read_robot_motion(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, kLimits.bytes);
  if (!text) return tl::unexpected(text.error());
  return parse_robot_motion(*text, path.string());
}

}  // namespace waymark
