#pragma once

#include "waymark/app/map/map_recording.hpp"

/// Extends an existing map with a lap.
namespace waymark {

/// Reads the map to be extended by the job's lap, from a file or from its folder.
[[nodiscard]] Status read_extended_map(const std::filesystem::path& map, MapJob& job);
/// Checks the job fields that concern the extended map. If there is such a map, specifying an anchor is an
/// error, because the map already has one. Otherwise, specifying a route name, tags to freeze or remove, or a
/// standard deviation is an error. A tag cannot be both removed and frozen.
[[nodiscard]] Status check_extension(const MapJob& job);

/// Prepares a lap that extends a map. Removed tags are deleted from both the lap and the map, tag sizes are
/// taken from the map, and a map tag becomes the anchor of the lap. Fails if no map tag is observed, or if a
/// tag to freeze or remove is not in the map.
[[nodiscard]] Status prepare_extension(const MapJob& job, RecordedLap& recorded, SetupOverrides& overrides,
                                       MapLapOptions& options);
/// The map file for a lap. If the lap extends a map, the observation counts and the provenance of that map
/// are included.
[[nodiscard]] MapFile map_file_of(const MapJob& job, const TagId& anchor, const MappedLap& lap);

}  // namespace waymark
