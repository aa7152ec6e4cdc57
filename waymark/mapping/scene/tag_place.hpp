#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "waymark/geometry/se3.hpp"
#include "waymark/mapping/scene/scene_map.hpp"
#include "waymark/mapping/solver/pose_votes.hpp"

/// The place of one tag, from frames whose poses other tags determine.
namespace waymark {

/// The one or two poses cam_T_tag of each term.
using TagSquares = std::vector<std::vector<internal::Hypothesis>>;

/// The placed corner terms of the tag with this size, in frames that show another tag in use. The pointers
/// are into the bundle of the map.
[[nodiscard]] std::vector<const CornerTerm*> terms_beside_others(const SceneMap& map, std::size_t size);

[[nodiscard]] TagSquares squares_of(const Bundle& bundle, const std::vector<const CornerTerm*>& terms);

/// The pose of the terms' tag that at least half of the terms agree on.
[[nodiscard]] std::optional<SE3> agreed_place(const Bundle& bundle,
                                              const std::vector<const CornerTerm*>& terms,
                                              const TagSquares& squares);

}  // namespace waymark
