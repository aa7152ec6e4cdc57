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

/// The landmarks in a map file, and the tags with their poses if there are any.
struct LandmarksFile {
  Landmarks landmarks{};
  TagMap tags{};
  std::string format{};              ///< "waymark", "academy", "wpilib", "fmap", "points"
  std::optional<FieldSize> field{};  ///< if given in the file
  std::vector<std::string> notes{};  ///< values assumed because the file lacks them (the tag size)
};

/// Reads a map of any kind that can be used for localisation, recognised from its content
/// (docs/formats/map.md, "Maps of others"). The kinds are map.yaml or its folder, the Robotics Academy's
/// apriltags_poses.yaml, a WPILib field layout (JSON or its CSV), and a Limelight field map (FMAP). A CSV
/// file with columns id (or landmark), x (x_m) and y (y_m) is read as well. The Academy's positions are the
/// centres of boards 20 mm thick, so the tag face is 10 mm nearer to the viewer. `tag_size_m` is the tag size
/// to use if the file does not contain it. Errors contain file, line and key.
[[nodiscard]] Result<LandmarksFile> read_landmarks(const std::filesystem::path& path,
                                                   std::optional<double> tag_size_m = {});
[[nodiscard]] Result<LandmarksFile> parse_landmarks(std::string_view text, const std::string& source,
                                                    std::optional<double> tag_size_m = {});

}  // namespace waymark
