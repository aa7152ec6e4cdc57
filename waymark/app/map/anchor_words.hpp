#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/lap_input.hpp"

namespace waymark {

/// What a map stands on, as people say it.
struct AnchorWords {
  std::string anchor{};                ///< "tag36h11:0", or its id; empty: as the recording says
  std::vector<double> anchor_pose{};   ///< x, y, z [m], roll, pitch, yaw [deg] of the tag's frame; empty: so
  std::optional<double> tag_size_m{};  ///< the same
};

/// Fails on numbers that are not finite, an anchor more than 10 km away, and a size that is none.
[[nodiscard]] Result<SetupOverrides> overrides_of(const AnchorWords& words);

}  // namespace waymark
