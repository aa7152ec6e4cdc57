#pragma once

#include <string>
#include <vector>

#include "waymark/app/map/map_recording.hpp"

namespace waymark {

/// What a user says of a map to be made of a lap: names, files, names of tags, degrees.
struct MapDescription {
  std::string method = "bundle";
  std::string anchor{};                  ///< of its tags; empty: as the recording says
  std::vector<double> anchor_pose{};     ///< AnchorWords::anchor_pose
  std::vector<std::string> tag_sizes{};  ///< as parse_tag_sizes() has them; empty: as the recording says
  std::string world{};                   ///< name or file of the truth; empty: what the recording holds
  std::string prior{};                   ///< file of an older map to compare with; empty: none
  std::string extend{};                  ///< map, or its folder, that the lap is to improve; empty: none
  std::string route_name{};
  std::vector<std::string> freeze{};  ///< tags of that map
  std::vector<std::string> remove{};
};

/// Gives the job method, anchor, sizes and truth of the description. Errors name the flag of `waymark map` at
/// fault, or the file of the world.
[[nodiscard]] Status describe_map(const MapDescription& description, MapJob& job);
/// Afterwards: the maps that are named, and what is said of their tags.
[[nodiscard]] Status read_described_maps(const MapDescription& description, MapJob& job);

}  // namespace waymark
