#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "waymark/geometry/se3.hpp"
#include "waymark/mapping/solver/pose_votes.hpp"

/// The place of one tag, from frames whose poses other tags determine.
namespace waymark {

/// The one or two poses cam_T_tag of each term.
using TagSquares = std::vector<std::vector<internal::Hypothesis>>;

/// Whether all four poses of a term are placed. `placed`: for each pose; if it is empty, all are.
[[nodiscard]] bool is_placed(const CornerTerm& term, const std::vector<char>& placed);

/// The placed corner terms of the tag with this size, in frames that show another tag in use. The pointers
/// are into the bundle. `placed`: as in is_placed().
[[nodiscard]] std::vector<const CornerTerm*> terms_beside_others(const Bundle& bundle,
                                                                 const std::vector<char>& placed,
                                                                 std::size_t size);

[[nodiscard]] TagSquares squares_of(const Bundle& bundle, const std::vector<const CornerTerm*>& terms);

/// The votes of the terms for the pose of their tag; an empty vote if the corners are not those of a square.
[[nodiscard]] std::vector<internal::Vote<SE3>> votes_for_tag(const Bundle& bundle,
                                                             const std::vector<const CornerTerm*>& terms,
                                                             const TagSquares& squares);

/// The pose of the terms' tag that at least half of the terms agree on.
[[nodiscard]] std::optional<SE3> agreed_place(const Bundle& bundle,
                                              const std::vector<const CornerTerm*>& terms,
                                              const TagSquares& squares);

}  // namespace waymark
