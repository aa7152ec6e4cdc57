#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/config/exchange/field_layouts.hpp"
#include "waymark/localization/landmarks.hpp"

namespace waymark {

/// The known places of a map file, and the tags with poses where it has such.
struct LandmarksFile {
  Landmarks landmarks{};
  TagMap tags{};
  std::string format{};              ///< "waymark", "academy", "wpilib", "fmap", "points"
  std::optional<FieldSize> field{};  ///< where the file states it
  std::vector<std::string> notes{};  ///< what was assumed, as the file does not contain it: the size of tags
};

/// A map of any kind that can be localised in, told by its content (docs/formats/map.md, "Maps of others"):
/// our map.yaml, or the folder it is in; apriltags_poses.yaml of the Robotics Academy (its places are the
/// middles of boards 20 mm thick: the face is 10 mm nearer); a field layout of WPILib (JSON or its CSV); a
/// field map of Limelight (FMAP); CSV with columns id (or landmark), x (x_m), y (y_m). `tag_size_m` is the
/// size of tags whose file does not say it. Errors have file, line and key.
[[nodiscard]] Result<LandmarksFile> read_landmarks(const std::filesystem::path& path,
                                                   std::optional<double> tag_size_m = {});
[[nodiscard]] Result<LandmarksFile> parse_landmarks(std::string_view text, const std::string& source,
                                                    std::optional<double> tag_size_m = {});

}  // namespace waymark
