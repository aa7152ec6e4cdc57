#pragma once

#include "waymark/app/map/map_recording.hpp"

/// Extends an existing map with a lap.
namespace waymark {

/// Reads the map that the job's lap extends, from a file or its folder.
[[nodiscard]] Status read_extended_map(const std::filesystem::path& map, MapJob& job);
/// Checks the job fields that concern the extended map. If such a map is given, an anchor is an error, as the
/// map already has one. Otherwise a route name, tags to freeze or remove, and a standard deviation are
/// errors. A tag cannot be both removed and frozen.
[[nodiscard]] Status check_extension(const MapJob& job);

/// Prepares a lap that extends a map: deletes removed tags from both, uses the tag size from the map, and
/// makes a map tag the anchor of the lap. Fails if no map tag is observed, or if a tag to freeze or remove is
/// not in the map.
[[nodiscard]] Status prepare_extension(const MapJob& job, RecordedLap& recorded, SetupOverrides& overrides,
                                       MapLapOptions& options);
/// The map file of a lap. For an extension it includes the observation counts and the provenance of the
/// extended map.
[[nodiscard]] MapFile map_file_of(const MapJob& job, const TagId& anchor, const MappedLap& lap);

}  // namespace waymark
