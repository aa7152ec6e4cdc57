#pragma once

#include <vector>

#include "waymark/mapping/lap/chain_links.hpp"
#include "waymark/mapping/lap/floor_observations.hpp"
#include "waymark/mapping/lap/odometry_track.hpp"

namespace waymark::internal {

/// Places tags that no other tag leads to: those of the next aisle, or of another room. Tags that links tie
/// to each other are placed as the chain places them, and the whole of them where the wheels have it, from
/// the last frame before that saw placed tags, or else the first one after. So what wheels add up to from one
/// end of the way to the other is not in how the frames about a tag stand to each other, which is what a
/// search begins with. `noise`: as in votes_for_base(). Tags that too few frames agree on are left out.
/// O(frames + links).
void place_islands(const std::vector<FloorFrame>& frames, const Links& links, const OdometryTrack& wheels,
                   const Eigen::Matrix3d& noise, bool spread_closing_errors, Places& places);

}  // namespace waymark::internal
