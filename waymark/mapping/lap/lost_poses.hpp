#pragma once

#include <vector>

#include "waymark/mapping/lap/bundle_map.hpp"

/// Re-initialises poses in a wrong local minimum, with the value that most of their observations agree on.
namespace waymark::internal {

/// Re-initialises frames with mostly inconsistent observations, which were placed by a wrong observation (a
/// wrong id, a moved tag). The new pose is the one on which the observations of the frame and odometry from
/// nearby frames agree. Returns whether any frame was moved.
bool reinitialise_lost_frames(const LapInput& input, const BundleMapOptions& options, LapBundle& lap);

/// Re-initialises tags with mostly inconsistent observations, which started in a wrong pose, such as the
/// wrong one of two poses. Returns whether any tag was moved.
bool reinitialise_lost_tags(const LapInput& input, const BundleMapOptions& options, LapBundle& lap);

/// Places tags that the chain could not place (too far away, for example) and removes them from the list of
/// unconnected tags. Returns whether any was placed.
bool place_unconnected(const LapInput& input, const BundleMapOptions& options, LapBundle& lap,
                       std::vector<TagId>& unconnected);

/// Repairs jumps of the trajectory. A moved tag can pull the trajectory apart between its two poses, because
/// odometry has a low weight and a jump of the robot costs less than many observations. If the trajectory
/// jumps and odometry does not, the search is repeated without one of the most inconsistent tags. Odometry is
/// then weighted by the accuracy of most of it. Another search with all tags and the usual weights follows.
/// The result with the lowest cost is kept. `summary`: of the search whose result is in the bundle.
void repair_trajectory_jumps(const LapInput& input, const BundleMapOptions& options,
                             const BundleOptions& search, const BundleProgress& progress, LapBundle& lap,
                             BundleSummary& summary);

}  // namespace waymark::internal
