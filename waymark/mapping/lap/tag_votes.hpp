#pragma once

#include <string>

#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/pose/agreement.hpp"

namespace waymark::internal {

/// Where a tag would have to be for one observation from a known base pose, once for each of its poses that
/// is possible; empty when the observation gives no pose. `camera`: the name of the one that saw it.
[[nodiscard]] Vote<SE3> vote_for_place(const TagDetection& detection, const std::string& camera,
                                       const LapInput& lap, const SE3& map_T_base);

/// Where the base would have to be for one observation of a tag in a known place.
[[nodiscard]] Vote<SE3> vote_for_base(const TagDetection& detection, const std::string& camera,
                                      const LapInput& lap, const SE3& map_T_tag);

}  // namespace waymark::internal
