#pragma once

#include <vector>

#include "waymark/mapping/lap/bundle_map.hpp"

/// Re-initialises poses that are in a wrong local minimum, using the value that most of their observations
/// agree on.
namespace waymark::internal {

/// Re-initialises frames whose observations are mostly inconsistent, because the frame was placed using a
/// wrong observation (a wrong id or a moved tag). The new pose is the one on which the observations of the
/// frame and odometry from nearby frames agree. Returns whether any frame was moved.
bool reinitialise_lost_frames(const LapInput& input, const BundleMapOptions& options, LapBundle& lap);

/// Re-initialises tags whose observations are mostly inconsistent, because the tag started from a wrong pose,
/// such as the wrong one of two possible poses. Returns whether any tag was moved.
bool reinitialise_lost_tags(const LapInput& input, const BundleMapOptions& options, LapBundle& lap);

/// Places tags that the chain could not place (because they are too far away, for example) and removes them
/// from the list of unconnected tags. Returns whether any tag was placed.
bool place_unconnected(const LapInput& input, const BundleMapOptions& options, LapBundle& lap,
                       std::vector<TagId>& unconnected);

/// Repairs jumps in the trajectory. The two poses of a moved tag can pull the trajectory apart, because
/// odometry has a low weight and a jump of the robot costs less than many inconsistent observations. If the
/// trajectory jumps and odometry does not, the search is repeated without each of the most inconsistent tags
/// in turn. In this search, odometry is weighted by the accuracy of the majority of its motions. Another
/// search with all tags and the usual weights follows. The result with the lowest cost is kept. `summary`:
/// the summary of the search whose result is in the bundle.
void repair_trajectory_jumps(const LapInput& input, const BundleMapOptions& options,
                             const BundleOptions& search, const BundleProgress& progress, LapBundle& lap,
                             BundleSummary& summary);

}  // namespace waymark::internal
