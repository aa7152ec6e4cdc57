#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/config/exchange/field_layouts.hpp"
#include "waymark/config/yaml/map_file.hpp"

/// Tag maps in formats of other programs (docs/formats/map.md, "Maps of others").
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
  std::vector<std::string> warnings{};  ///< what could not be converted
  std::optional<FieldSize> field{};     ///< if given in a field layout
};

/// Reads a map in any of these forms, recognised by its content, or the map.yaml of a folder. `tag_size_m` is
/// the tag size if the file does not contain it; transforms require it. If a file does not specify the
/// anchor, the first tag becomes the anchor. Errors have file, line and key.
[[nodiscard]] Result<ReadMap> read_any_map(const std::filesystem::path& path,
                                           std::optional<double> tag_size_m = {});
[[nodiscard]] Result<ReadMap> parse_any_map(std::string_view text, const std::string& source,
                                            std::optional<double> tag_size_m = {});

/// Writes the map in another form. Information that the form cannot hold (covariances in transforms, a
/// leaning tag in the Academy's) is reported in `warnings`. `field`: size for layouts; default: the box of
/// the tags. Fails on an empty map and if two tags differ only in their family.
[[nodiscard]] Result<std::string> to_text(const MapFile& map, MapForm form,
                                          std::vector<std::string>& warnings,
                                          const std::optional<FieldSize>& field = {});

}  // namespace waymark
