#pragma once

#include <string>

#include "waymark/app/map/map_recording.hpp"
#include "waymark/app/scene/map_scene.hpp"
#include "waymark/app/video/map_video.hpp"

namespace waymark {

/// What `waymark map` prints of a map that it wrote into this folder.
[[nodiscard]] std::string to_text(const MapReport& report, const std::string& folder);
[[nodiscard]] std::string to_text(const MapSceneReport& report, const std::string& folder);
[[nodiscard]] std::string to_text(const MapVideoReport& report, const std::string& folder);

}  // namespace waymark
