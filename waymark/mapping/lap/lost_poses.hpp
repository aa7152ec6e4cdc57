#pragma once

#include <vector>

#include "waymark/mapping/lap/bundle_map.hpp"

/// Poses that a search began too far from the truth to find it, placed anew by what most of their
/// observations agree on.
namespace waymark::internal {

/// A frame most of whose observations contradict the map was placed by one that is wrong (a wrong id, a tag
/// that was moved): it is placed by what its observations and the wheels from the frames about it agree on.
/// Whether any was.
bool place_lost_frames_again(const LapInput& input, const BundleMapOptions& options, LapBundle& lap);

/// A tag most of whose observations contradict its place was started in the wrong one, on the other of its
/// two poses for example. Whether any was placed anew.
bool place_lost_tags_again(const LapInput& input, const BundleMapOptions& options, LapBundle& lap);

/// Tags the chain could not place (too far away for it, say). Those that were are taken from the list of the
/// unconnected; whether any was.
bool place_unconnected(const LapInput& input, const BundleMapOptions& options, LapBundle& lap,
                       std::vector<TagId>& unconnected);

/// A tag that was moved can pull the way apart between its two places: wheels are trusted little, so that a
/// jump of the robot costs less than many observations. Where the way jumps and the wheels did not, the
/// search is tried again without one of the tags that contradict most, with wheels as exact as most of them
/// are, and then as before with all; what explains everything better stays. `summary` is of the search that
/// ended where the bundle is.
void repair_trajectory_jumps(const LapInput& input, const BundleMapOptions& options,
                             const BundleOptions& search, const BundleProgress& progress, LapBundle& lap,
                             BundleSummary& summary);

}  // namespace waymark::internal
