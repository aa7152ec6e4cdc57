#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/jobs/camera_description.hpp"
#include "waymark/jobs/map_video.hpp"

namespace waymark {

/// What a user says of the camera and the place of a video: files, names of tags, degrees, milliseconds.
struct MapVideoDescription {
  CameraDescription camera{};
  double tag_size_sigma_m = 0.0005;
  std::string anchor{};                     ///< tags, "3,7"; empty: chosen
  std::string prior{};                      ///< file of a map; empty: none
  std::optional<double> prior_sigma_m{};    ///< of its places ...
  std::optional<double> prior_sigma_deg{};  ///< ... and directions
  std::vector<std::string> distances{};     ///< "3,7,2.41" or "3,7,2.41,0.002"
  std::vector<std::string> upright{};       ///< tags, "3" or "3,7"
  std::vector<std::string> floor{};
  std::vector<std::string> planes{};  ///< each: tags on one plane, "3,4,7"
  double level_sigma_deg = 1;
};

/// A job with the camera, anchors, distances and levels of the description; what else it needs is the
/// caller's. Errors name the flag of `waymark map` at fault, or the file.
[[nodiscard]] Result<MapVideoJob> described_map_video(const MapVideoDescription& description,
                                                      std::optional<double> tag_size_m);

}  // namespace waymark
