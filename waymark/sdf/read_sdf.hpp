#pragma once

#include <filesystem>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/sdf/sdf_scene.hpp"

namespace waymark {

/// The first world of a file in SDF (any version that SDFormat 12 reads), or of one that holds a model alone.
/// model:// and relative names are looked for in the folders, then beside the file, in `models` beside it and
/// above, and where IGN_GAZEBO_RESOURCE_PATH and SDF_PATH point. Fails on what is no SDF, and where the
/// module for SDF is not installed.
[[nodiscard]] Result<SdfScene> read_sdf(const std::filesystem::path& file,
                                        const std::vector<std::filesystem::path>& folders = {});

/// What the module exports: the scene, or an error with a message.
using ReadSdfFunction = void (*)(const std::filesystem::path& file,
                                 const std::vector<std::filesystem::path>& folders, SdfScene& scene,
                                 Error& error);
inline constexpr const char* kReadSdfSymbol = "waymark_read_sdf";

}  // namespace waymark
