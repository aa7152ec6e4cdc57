#pragma once

#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/sdf/sdf_scene.hpp"

namespace waymark {

/// A tag that is painted on a visual.
struct PaintedTag {
  TagId tag{};
  MappedTag placed{};       ///< pose (frame world) and size
  std::size_t visual = 0;   ///< index in SdfScene::visuals
  double margin_cells = 0;  ///< white around its total width, to the nearest edge of the picture
  double error = 0;         ///< largest difference of a side from the mean, as a share of it
};

struct PaintedTags {
  std::vector<PaintedTag> tags{};       ///< in the order of the visuals, faces as triangles_of() has them
  std::vector<std::string> warnings{};  ///< pictures that cannot be read, tags that are mirrored or stretched
};

/// The tags in the textures of a scene, found by the detector in the picture itself, whatever its name, and
/// placed by how the picture lies on the shape. `families` are looked for. A tag that is no square within 2
/// %, or smaller than 5 mm, is none (the narrow sides of a board). Fails where no family is known.
[[nodiscard]] Result<PaintedTags> find_painted_tags(const SdfScene& scene,
                                                    const std::vector<std::string>& families);

}  // namespace waymark
