#pragma once

#include <filesystem>
#include <future>
#include <string>

#include "waymark/base/error.hpp"

/// The files of an operator's story: nothing that was there is written over.
namespace waymark::cli {

/// "lap.mcap", or "lap.2.mcap" where that is taken.
[[nodiscard]] std::string free_name(const std::filesystem::path& folder, const std::string& stem);

/// Where a map is made before it takes its place.
[[nodiscard]] inline std::filesystem::path new_map_folder(const std::filesystem::path& story) {
  return story / "map.new";
}
/// Puts the fresh folder in the place of another, which becomes NAME.1, or the next number that is free.
/// Where that is; empty when there was none.
[[nodiscard]] Result<std::string> replace_folder(const std::filesystem::path& folder,
                                                 const std::filesystem::path& fresh);

/// Maps the lap into the folder, on a thread of its own and without a word. What a story that was cut off
/// left there is removed.
[[nodiscard]] std::future<Status> map_in_the_background(const std::string& lap,
                                                        const std::filesystem::path& folder);

}  // namespace waymark::cli
