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

/// Contents of map.yaml (docs/formats/map.md).
struct MapFile {
  TagMap tags{};
  std::map<TagId, int> observations{};  ///< number of frames that show a tag; no entry if unknown
  TagId anchor{};                       ///< the tag whose pose was given
  /// Origin of the map as text, in file order: method, recording, …
  std::vector<std::pair<std::string, std::string>> provenance{};
};

/// Reads a map. Fails with file, line and key on a file of another kind, an unknown or missing key, a
/// duplicate tag, or a tag that is not in its family. Invalid quaternions, covariances without 21 numbers,
/// and an anchor that is not among the tags are errors too. So is a written file that was cut at the end of a
/// line: it declares its number of tags, and `end` with the same number is its last key.
[[nodiscard]] Result<MapFile> read_map(const std::filesystem::path& path);
/// map.yaml in the folder if the path is a folder, else the path itself.
[[nodiscard]] std::filesystem::path map_file_of(const std::filesystem::path& map_or_folder);
[[nodiscard]] Result<MapFile> parse_map(std::string_view text, const std::string& source);

/// The text reads back as exactly the same map, except for the norms of the quaternions. Every number must be
/// finite.
[[nodiscard]] std::string to_yaml(const MapFile& map);
/// Fails (InvalidArgument) without writing if a number is not finite or a tag does not exist in its family.
[[nodiscard]] Status write_map(const std::filesystem::path& path, const MapFile& map);

}  // namespace waymark
