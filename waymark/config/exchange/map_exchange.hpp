#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/config/exchange/field_layouts.hpp"
#include "waymark/config/yaml/map_file.hpp"

/// Tag maps in the formats of other programs (docs/formats/map.md, "Maps of others").
namespace waymark {

enum class MapForm : std::uint8_t {
  Waymark,     ///< map.yaml
  Academy,     ///< the Robotics Academy's apriltags_poses.yaml
  Tagslam,     ///< `bodies` in TagSLAM's tagslam.yaml, or its poses.yaml
  Transforms,  ///< tf transforms (geometry_msgs/TransformStamped) as YAML
  Wpilib,  ///< WPILib and PhotonVision field layout: JSON, or the CSV from which it is generated (read only)
  Fmap,    ///< Limelight field map
};

/// "waymark", "academy", "tagslam", "tf", "wpilib", "fmap".
[[nodiscard]] std::vector<std::string> map_form_names();
[[nodiscard]] Result<MapForm> map_form(const std::string& name);

struct ReadMap {
  MapFile map{};
  MapForm form = MapForm::Waymark;
  std::vector<std::string> warnings{};  ///< what could not be converted
  std::optional<FieldSize> field{};     ///< if given in a field layout
};

/// Reads a map in any of these formats, recognised from its content, or the map.yaml in a folder.
/// `tag_size_m` is the tag size to use if the file does not contain it; it is required for transforms. If a
/// file does not specify the anchor, the first tag becomes the anchor. Errors contain file, line and key.
[[nodiscard]] Result<ReadMap> read_any_map(const std::filesystem::path& path,
                                           std::optional<double> tag_size_m = {});
[[nodiscard]] Result<ReadMap> parse_any_map(std::string_view text, const std::string& source,
                                            std::optional<double> tag_size_m = {});

/// Writes the map in another format. Information that the format cannot hold (covariances in transforms, a
/// tilted tag in the Academy's format) is reported in `warnings`. `field` is the field size for layouts, by
/// default the bounding box of the tags. Fails if the map is empty or if two tags differ only in their
/// family.
[[nodiscard]] Result<std::string> to_text(const MapFile& map, MapForm form,
                                          std::vector<std::string>& warnings,
                                          const std::optional<FieldSize>& field = {});

}  // namespace waymark
