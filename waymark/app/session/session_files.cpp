#include "waymark/app/session/session_files.hpp"

#include <system_error>

#include <fmt/format.h>

namespace waymark {

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
  std::error_code ignored;
  if (!kept.empty() && !fs::exists(folder, ignored)) fs::rename(kept, folder, ignored);  // as it was
  return fail(ErrorCode::Unwritable, "cannot put the new map in its place: " + error.message(),
              {.source = folder.string()});
}

}  // namespace

void MapInTheMaking::begin(const MapMaker& make, const std::string& lap, const fs::path& folder) {
  began_ = std::chrono::steady_clock::now();
  folder_ = folder;
  std::error_code ignored;
  fs::remove_all(beside(folder), ignored);
  made_ = std::async(std::launch::async,
                     [make, lap, fresh = beside(folder)]() -> Status { return make(lap, fresh); });
}

double MapInTheMaking::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
}

bool MapInTheMaking::ready() const {
  return made_.valid() && made_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

Result<std::string> MapInTheMaking::take() {
  if (Status made = made_.get(); !made) {
    std::error_code ignored;
    fs::remove_all(beside(folder_), ignored);
    return tl::unexpected(made.error());
  }
  return replace_folder(folder_, beside(folder_));
}

}  // namespace waymark
