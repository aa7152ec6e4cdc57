#pragma once

#include <vector>

#include "waymark/simulation/photograph.hpp"
#include "waymark/simulation/planar_pattern.hpp"

namespace waymark::photo {

/// A tag with its paper: one cell of the pattern a cell of the tag, and the margin around.
[[nodiscard]] PlanarPattern tag_pattern(const TagInScene& tag);

/// A sheet: one cell of the pattern a pixel of the raster.
[[nodiscard]] PlanarPattern sheet_pattern(const SheetInScene& sheet);

/// All tags and sheets, the farthest first. Ties keep the scene's order, tags before sheets.
[[nodiscard]] std::vector<PlanarPattern> patterns_from_far_to_near(const PhotographScene& scene);

/// The truth about one tag; nothing when a corner does not project.
[[nodiscard]] std::optional<TagTruth> tag_truth(const CameraModel& camera, const TagInScene& tag,
                                                const std::vector<PlanarPattern>& patterns);

}  // namespace waymark::photo
