#pragma once

#include "waymark/app/map/map_recording.hpp"

/// Extension of an existing map by a lap.
namespace waymark {

/// Reads the map, a file or its folder, that the job's lap extends.
[[nodiscard]] Status read_extended_map(const std::filesystem::path& map, MapJob& job);
/// Fails if fields of the job about the extended map contradict each other: an anchor, which
/// that map already has; a route name, tags and a standard deviation without such a map; a tag that is both
/// removed and frozen.
[[nodiscard]] Status check_extension(const MapJob& job);

/// Prepares a lap that extends a map: removed tags are deleted from both, sizes are the map's, and the
/// lap's anchor becomes a map tag. Fails if the lap observes no map tag, or if a tag that should be
/// frozen or removed is not in it.
[[nodiscard]] Status prepare_extension(const MapJob& job, RecordedLap& recorded, SetupOverrides& overrides,
                                       MapLapOptions& options);
/// The map to write, from a lap, or from a lap and the map that it extends.
[[nodiscard]] MapFile map_file_of(const MapJob& job, const TagId& anchor, const MappedLap& lap);

}  // namespace waymark
