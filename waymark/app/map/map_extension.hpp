#pragma once

#include "waymark/app/map/map_recording.hpp"

/// A lap that improves a map that is there: `waymark map --extend`.
namespace waymark {

/// What --extend, --route-name, --freeze and --remove say, read into the job.
[[nodiscard]] Status read_extension(const std::string& extend, const std::string& route_name,
                                    const std::vector<std::string>& freeze,
                                    const std::vector<std::string>& remove, MapJob& job);

/// A lap that is to improve a map: tags to be removed are taken out of both, sizes are the map's, and the
/// lap's anchor becomes a tag the map has. Fails when the lap sees no tag of the map, or a tag that should be
/// frozen or removed is not in it.
[[nodiscard]] Status prepare_extension(const MapJob& job, RecordedLap& recorded, SetupOverrides& overrides,
                                       MapLapOptions& options);
/// The map of a lap, or of a lap and the map it extends, as it is written.
[[nodiscard]] MapFile map_file_of(const MapJob& job, const TagId& anchor, const MappedLap& lap);

}  // namespace waymark
