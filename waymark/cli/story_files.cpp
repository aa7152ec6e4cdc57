#include "waymark/cli/story_files.hpp"

#include <chrono>
#include <cstdio>
#include <system_error>

#include <fmt/format.h>

namespace waymark::cli {

namespace fs = std::filesystem;

std::string free_name(const fs::path& folder, const std::string& stem) {
  fs::path path = folder / (stem + ".mcap");
  std::error_code ignored;
  for (int number = 2; fs::exists(path, ignored); ++number)
    path = folder / fmt::format("{}.{}.mcap", stem, number);
  return path.string();
}

namespace {

/// Where a map is made before it takes its place.
fs::path beside(const fs::path& folder) { return folder.string() + ".new"; }

Result<std::string> replace_folder(const fs::path& folder, const fs::path& fresh) {
  std::error_code error;
  fs::path kept;
  if (fs::exists(folder, error)) {
    int number = 1;
    const auto numbered = [&] { return fs::path(fmt::format("{}.{}", folder.string(), number)); };
    while (fs::exists(numbered(), error)) ++number;
    kept = numbered();
    fs::rename(folder, kept, error);
  }
  if (!error) fs::rename(fresh, folder, error);
  if (!error) return kept.string();
  return fail(ErrorCode::Unwritable, "cannot put the new map in its place: " + error.message(),
              {.source = folder.string()});
}

}  // namespace

void MapInTheMaking::begin(const std::string& lap, const fs::path& folder) {
  watch_ = Stopwatch();
  folder_ = folder;
  std::error_code ignored;
  fs::remove_all(beside(folder), ignored);
  made_ = std::async(std::launch::async, [lap, fresh = beside(folder)]() -> Status {
    std::FILE* nowhere = std::fopen("/dev/null", "w");
    if (nowhere == nullptr) return fail(ErrorCode::Unwritable, "/dev/null cannot be opened");
    Console quiet("waymark run", nowhere, nowhere);
    const Result<MapReport> mapped = map_recording({.lap = lap, .folder = fresh}, quiet);
    (void)std::fclose(nowhere);
    return mapped ? Status() : tl::unexpected(mapped.error());
  });
}

bool MapInTheMaking::ready() const {
  return made_.valid() && made_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

Result<std::string> MapInTheMaking::take() {
  if (Status made = made_.get(); !made) return tl::unexpected(made.error());
  return replace_folder(folder_, beside(folder_));
}

}  // namespace waymark::cli
