#pragma once

#include <map>
#include <string>
#include <vector>

#include "waymark/pipeline/teacher.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/samples/route.hpp"

namespace waymark {

struct MapLapOptions {
  std::string method = "chain";  ///< how tags are placed: "chain" (map_by_chain)
  ChainOptions chain{};
  RouteOptions route{};
};

/// The names of the methods, as `--method` takes them.
[[nodiscard]] std::vector<std::string> map_methods();

/// What a lap becomes.
struct MappedLap {
  TagMap map{};
  std::map<TagId, int> observations{};  ///< frames that saw each tag of the map
  Trajectory trajectory{};
  Route route{};
  int frames = 0;
  int frames_without_pose = 0;
  std::vector<std::string> warnings{};  ///< what is missing or doubtful, in words
};

/// The map phase: frames of a taught lap in, a map of the tags, the way the base went and a route out. Fails
/// on an unknown method, on a lap without frames, without the anchor, or too short for a route.
[[nodiscard]] Result<MappedLap> map_lap(const std::vector<TagFrame>& frames, const TeachSetup& setup,
                                        const MapLapOptions& options = {});

}  // namespace waymark
