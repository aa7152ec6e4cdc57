#include "waymark/config/tagslam_folder.hpp"

#include "waymark/config/tagslam_parts.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMaxTagslamBytes = std::size_t{1} << 22U;
constexpr int kTag36h11Codes = 587;

Result<YamlNode> parse_tagslam_file(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, kMaxTagslamBytes);
  if (!text) return tl::unexpected(text.error());
  return parse_yaml(*text, path.string(), {.bytes = kMaxTagslamBytes, .nodes = 1'000'000});
}

/// TagSLAM's files do not name the family: an id says what it cannot be.
void name_family(TagScene& scene) {
  bool larger = false;
  for (const SceneBody& body : scene.bodies) {
    for (const SceneTag& tag : body.tags) larger = larger || tag.id.number >= kTag36h11Codes;
  }
  if (!larger) return;
  for (SceneBody& body : scene.bodies) {
    for (SceneTag& tag : body.tags) tag.id.family = FamilyId::TagStandard41h12;
  }
}

Result<TagScene> read_tagslam_files(const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::exists(folder / "tagslam.yaml", error) &&
      std::filesystem::exists(folder / "config.json", error)) {
    const Result<YamlNode> config = parse_tagslam_file(folder / "config.json");
    if (!config) return tl::unexpected(config.error());
    return internal::read_tagslam_json(YamlCursor(*config, (folder / "config.json").string()));
  }
  const Result<YamlNode> tagslam = parse_tagslam_file(folder / "tagslam.yaml");
  if (!tagslam) return tl::unexpected(tagslam.error());
  const Result<YamlNode> cameras = parse_tagslam_file(folder / "cameras.yaml");
  if (!cameras) return tl::unexpected(cameras.error());
  std::optional<YamlCursor> poses;
  Result<YamlNode> camera_poses = YamlNode{};
  if (std::filesystem::exists(folder / "camera_poses.yaml", error)) {
    camera_poses = parse_tagslam_file(folder / "camera_poses.yaml");
    if (!camera_poses) return tl::unexpected(camera_poses.error());
    poses.emplace(*camera_poses, (folder / "camera_poses.yaml").string());
  }
  return internal::read_tagslam_yaml(YamlCursor(*tagslam, (folder / "tagslam.yaml").string()),
                                     YamlCursor(*cameras, (folder / "cameras.yaml").string()), poses);
}

}  // namespace

Result<TagScene> read_tagslam_folder(const std::filesystem::path& folder) {
  Result<TagScene> scene = read_tagslam_files(folder);
  if (!scene) return scene;
  if (scene->bodies.empty() || scene->cameras.empty())
    return fail(ErrorCode::InvalidArgument, "there must be at least one body and one camera",
                {.source = folder.string()});
  name_family(*scene);
  return scene;
}

}  // namespace waymark
