#pragma once

#include <map>
#include <utility>

#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/lap/floor_observations.hpp"

namespace waymark::internal {

/// from_X_to of two tags that were seen together, and how many frames agree on it.
struct Link {
  Uncertain<SE2> from_X_to{};
  int votes = 0;
};
/// From the smaller id to the larger.
using Links = std::map<std::pair<TagId, TagId>, Link>;
/// map_X_tag.
using Places = std::map<TagId, Uncertain<SE2>>;

/// Where the base was when a frame was taken, by every placed tag in it (equation 3.1, with that tag in the
/// anchor's place). `noise`: covariance of a place relative to its neighbours.
[[nodiscard]] std::vector<Vote<SE2>> votes_for_base(const FloorFrame& frame, const Places& places,
                                                    const Eigen::Matrix3d& noise);

/// For each pair of tags what all frames that saw both agree on.
[[nodiscard]] Links links_of(const std::vector<FloorFrame>& frames);

/// From the anchor outwards, by composition: the next tag is always the one that would be known best. Links
/// that few frames agree on, which one id read wrongly can make, are followed only where no better one leads
/// on. O(links * tags that wait at a time).
[[nodiscard]] Places compose_from_anchor(const Links& links, const TagId& anchor, const SE2& map_X_anchor);

/// Moves all tags but the anchor so that the links disagree least: what the two ways round a lap differ by
/// where they meet is spread over the whole chain. Links that contradict all others count little.
void spread_closing_error(const Links& links, const TagId& anchor, Places& places);

}  // namespace waymark::internal
