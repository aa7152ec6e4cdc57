#pragma once

#include "waymark/app/map/map_recording.hpp"

/// A lap that improves a map that is there.
namespace waymark {

/// Reads the map, a file or its folder, that the job's lap is to improve.
[[nodiscard]] Status read_extended_map(const std::filesystem::path& map, MapJob& job);
/// Fails where fields of the job contradict each other that are about the map it extends: an anchor, which
/// that map has; a name of a route, tags and a standard deviation without such a map; a tag that should go
/// and stay.
[[nodiscard]] Status check_extension(const MapJob& job);

/// A lap that is to improve a map: tags to be removed are taken out of both, sizes are the map's, and the
/// lap's anchor becomes a tag the map has. Fails when the lap sees no tag of the map, or a tag that should be
/// frozen or removed is not in it.
[[nodiscard]] Status prepare_extension(const MapJob& job, RecordedLap& recorded, SetupOverrides& overrides,
                                       MapLapOptions& options);
/// The map of a lap, or of a lap and the map it extends, as it is written.
[[nodiscard]] MapFile map_file_of(const MapJob& job, const TagId& anchor, const MappedLap& lap);

}  // namespace waymark
