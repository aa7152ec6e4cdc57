#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// What map.yaml holds (docs/formats/map.md).
struct MapFile {
  TagMap tags{};
  std::map<TagId, int> observations{};  ///< frames that saw a tag; a tag that is not here: not known
  TagId anchor{};                       ///< the tag whose pose was given
  /// Where the map comes from, in words, in the order of the file: method, recording, …
  std::vector<std::pair<std::string, std::string>> provenance{};
};

/// Errors have file, line and key: not a map, an unknown or missing key, a tag given twice or not in its
/// family, a quaternion that is none, a covariance that is not 21 numbers, an anchor that is not among the
/// tags.
[[nodiscard]] Result<MapFile> read_map(const std::filesystem::path& path);
/// map.yaml where a folder is given, else what is given.
[[nodiscard]] std::filesystem::path map_file_of(const std::filesystem::path& map_or_folder);
[[nodiscard]] Result<MapFile> parse_map(std::string_view text, const std::string& source);

/// Reads back as the same map, to the last bit but for the length of the quaternions. Every number must be
/// finite.
[[nodiscard]] std::string to_yaml(const MapFile& map);
/// Fails (InvalidArgument) on a number that is not finite, instead of writing it.
[[nodiscard]] Status write_map(const std::filesystem::path& path, const MapFile& map);

}  // namespace waymark
