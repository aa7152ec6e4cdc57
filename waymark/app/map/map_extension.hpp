#pragma once

#include "waymark/app/map/map_recording.hpp"

/// Extension of an existing map by a lap.
namespace waymark {

/// Reads the map, a file or its folder, that the job's lap extends.
[[nodiscard]] Status read_extended_map(const std::filesystem::path& map, MapJob& job);
/// Checks the fields of the job that concern the extended map. With such a map an anchor is an error, as the
/// map already has one. Without it a route name, tags to freeze or remove, and a standard deviation are
/// errors. A tag cannot be both removed and frozen.
[[nodiscard]] Status check_extension(const MapJob& job);

/// Prepares a lap that extends a map: deletes removed tags from both, takes the tag size from the map, and
/// makes a map tag the anchor of the lap. Fails if the lap observes no map tag, or if a tag to freeze or
/// remove is not in the map.
[[nodiscard]] Status prepare_extension(const MapJob& job, RecordedLap& recorded, SetupOverrides& overrides,
                                       MapLapOptions& options);
/// The map file of a lap. For an extension it includes the observation counts and the provenance of the
/// extended map.
[[nodiscard]] MapFile map_file_of(const MapJob& job, const TagId& anchor, const MappedLap& lap);

}  // namespace waymark
