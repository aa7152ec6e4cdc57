#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/mapping/lap/observed_frame.hpp"
#include "waymark/pose/floor_fit.hpp"

namespace waymark {

/// How a tag stands on the floor that the robot drives on.
struct AnchorStance {
  enum class Kind : std::uint8_t { Upright, Leaning, Lying };

  Kind kind = Kind::Upright;
  double tilt_rad = 0;  ///< between the tag's up (-y) and the floor's, or for a lying tag between its normal
                        ///< and the floor's
  /// The anchor in a map with its origin at the tag's centre, map z the floor's up, and map x the direction
  /// of tag z along the floor (lying: of tag x): of an upright tag map z = tag -y, map x = tag z.
  SE3 map_T_anchor{};
};

/// What the motion of a robot on its floor says of a tag; nothing when the tag was never seen. A tag counts
/// as leaning from 5 degrees on (a smaller lean is measured all the same), as lying from 64 degrees on.
[[nodiscard]] std::optional<AnchorStance> anchor_stance(const std::vector<ObservedFrame>& frames,
                                                        const TagId& anchor, const SE3& base_T_cam,
                                                        const FloorOptions& options = {});

/// What a person should know of it; empty for an upright tag.
[[nodiscard]] std::string in_words(const AnchorStance& stance, const TagId& anchor);

}  // namespace waymark
