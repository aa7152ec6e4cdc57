#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/config/exchange/field_layouts.hpp"
#include "waymark/config/yaml/map_file.hpp"

/// Maps of tags in the words of others (docs/formats/map.md, "Maps of others").
namespace waymark {

enum class MapForm : std::uint8_t {
  Waymark,     ///< map.yaml
  Academy,     ///< apriltags_poses.yaml of the Robotics Academy
  Tagslam,     ///< `bodies` of TagSLAM's tagslam.yaml, or its poses.yaml
  Transforms,  ///< transforms of tf (geometry_msgs/TransformStamped) as YAML
  Wpilib,      ///< field layout of WPILib and PhotonVision: JSON, or the CSV it is made of (read only)
  Fmap,        ///< field map of Limelight
};

/// "waymark", "academy", "tagslam", "tf", "wpilib", "fmap".
[[nodiscard]] std::vector<std::string> map_form_names();
[[nodiscard]] Result<MapForm> map_form(const std::string& name);

struct ReadMap {
  MapFile map{};
  MapForm form = MapForm::Waymark;
  std::vector<std::string> warnings{};  ///< what could not be taken along
  std::optional<FieldSize> field{};     ///< where a layout of a field states it
};

/// A map of any of these forms, told by its content; of a folder its map.yaml. `tag_size_m` is the size of
/// tags whose file does not say it: transforms never do, so there it must be given. Where a file does not
/// say which tag it was placed by, the first becomes the anchor. Errors have file, line and key.
[[nodiscard]] Result<ReadMap> read_any_map(const std::filesystem::path& path,
                                           std::optional<double> tag_size_m = {});
[[nodiscard]] Result<ReadMap> parse_any_map(std::string_view text, const std::string& source,
                                            std::optional<double> tag_size_m = {});

/// The map in another form. What the form cannot say (covariances in transforms, a tag that leans in the
/// Academy's) is added to `warnings`. `field`: of layouts; unless given, the box of the tags. Fails on an
/// empty map and where two tags differ by their family only.
[[nodiscard]] Result<std::string> to_text(const MapFile& map, MapForm form,
                                          std::vector<std::string>& warnings,
                                          const std::optional<FieldSize>& field = {});

}  // namespace waymark
