#pragma once

#include <vector>

#include "waymark/mapping/lap/bundle_map.hpp"
#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/mapping/lap/map_checks.hpp"

namespace waymark::internal {

/// The tags of a lap's map that were taken away or hidden (see missing_tags()), including those of the map
/// that the lap extends. `lap`: after the search, with covariance `P`. `map`: with tags and moved tags.
[[nodiscard]] std::vector<MissingTag> missing_lap_tags(const LapInput& input, const LapBundle& lap,
                                                       const BundleCovariance& P, const BundleMap& map);

/// Drops the tags that were later observed elsewhere, because check_map() reports that they were moved. A
/// misread id elsewhere does not suffice. `places`: of the recording with all its detections.
void drop_tags_observed_elsewhere(const std::vector<SecondPlace>& places, std::vector<MissingTag>& missing);

}  // namespace waymark::internal
