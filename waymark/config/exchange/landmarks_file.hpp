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

/// The landmarks of a map file, and the tags with poses if it has any.
struct LandmarksFile {
  Landmarks landmarks{};
  TagMap tags{};
  std::string format{};              ///< "waymark", "academy", "wpilib", "fmap", "points"
  std::optional<FieldSize> field{};  ///< if given in the file
  std::vector<std::string> notes{};  ///< assumed values that are not in the file: the tag size
};

/// Reads a map of any kind that can be used for localisation, recognised by its content (docs/formats/map.md,
/// "Maps of others"). The kinds are map.yaml or its folder, apriltags_poses.yaml of the Robotics Academy, a
/// field layout of WPILib (JSON or its CSV), and a field map of Limelight (FMAP). A CSV file with columns id
/// (or landmark), x (x_m), y (y_m) is read as well. Positions of the Academy are the centres of boards 20 mm
/// thick, so the face is 10 mm nearer. `tag_size_m` is the tag size if the file does not contain it. Errors
/// have file, line and key.
[[nodiscard]] Result<LandmarksFile> read_landmarks(const std::filesystem::path& path,
                                                   std::optional<double> tag_size_m = {});
[[nodiscard]] Result<LandmarksFile> parse_landmarks(std::string_view text, const std::string& source,
                                                    std::optional<double> tag_size_m = {});

}  // namespace waymark
