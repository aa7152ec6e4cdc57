#pragma once

#include "waymark/config/map_exchange.hpp"
#include "waymark/config/yaml_cursor.hpp"

/// For the .cpp files of map_exchange only.
namespace waymark::internal {

/// Tags of the bodies that stand still at a known pose.
[[nodiscard]] Result<ReadMap> read_tagslam_map(const YamlCursor& root, std::optional<double> tag_size_m);
/// Transforms whose child frame is named after a tag ("tag36h11:7").
[[nodiscard]] Result<ReadMap> read_transforms(const YamlCursor& root, std::optional<double> tag_size_m);

}  // namespace waymark::internal
