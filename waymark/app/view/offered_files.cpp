#include "waymark/app/view/offered_files.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// The files in a folder that the page can show: recordings, and the files of a map in the folder or in map/.
/// Links that lead outside the folder are added to `left_out`, so that write access to the folder does not
/// expose other files.
std::vector<OfferedFile> files_of(const fs::path& folder, std::vector<OfferedFile>& left_out) {
  std::vector<OfferedFile> files;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
    if (entry.is_regular_file(none) && entry.path().extension() == ".mcap")
      files.push_back({entry.path().filename().string(), entry.path(), OfferedFile::Kind::Recording});
  }
  std::ranges::sort(files, {}, &OfferedFile::name);
  for (const fs::path& place : {folder, folder / "map"}) {
    if (!fs::is_regular_file(place / "map.yaml", none)) continue;
    for (const fs::directory_entry& entry : fs::directory_iterator(place, none)) {  // includes the routes
                                                                                    // written by `waymark
                                                                                    // optimize`
      const std::string name = entry.path().filename().string();
      if (name.starts_with("route-") && name.ends_with(".yaml"))
        files.push_back({name, entry.path(), OfferedFile::Kind::Text});
    }
    for (const char* name :
         {"map.yaml", "route.yaml", "robot.yaml", "trajectory.txt", "truth_trajectory.txt"}) {
      if (fs::is_regular_file(place / name, none))
        files.push_back({name, place / name, OfferedFile::Kind::Text});
    }
    break;
  }
  for (OfferedFile& file : files) file.within = folder;
  const auto outside = std::ranges::stable_partition(
      files, [&](const OfferedFile& file) { return lies_within(file.path, folder); });
  left_out.assign(outside.begin(), outside.end());
  files.erase(outside.begin(), outside.end());
  return files;
}

/// The error for a file that cannot be shown, with its actual kind and a hint.
Error not_shown(const std::string& path, FileKind kind) {
  if (auto wrong = wrong_kind(path, FileUse::Page); wrong && !is_recording(kind)) {
    wrong->code = ErrorCode::Unsupported;
    return *std::move(wrong);
  }
  Error error{ErrorCode::Unsupported, "not an MCAP recording", {.source = path}, {}};
  std::error_code none;
  if (fs::is_regular_file(path, none) && fs::file_size(path, none) == 0) {
    error.message = "the file is empty: nothing was recorded, or the recorder ended before its first write";
    error.hint = "Record again, or use a copy that is not empty.";
  } else if (is_recording(kind)) {
    error.message = "a recording in a format without an index for the browser";
    error.hint = fmt::format("Convert it first: `waymark convert {} out.mcap`.", shell_word(path));
  } else {
    error.message = "neither a recording nor the YAML of a map or a route";
    error.hint =
        "The page shows MCAP recordings, map.yaml, and the folders of maps and demos; `waymark convert` "
        "converts tables and logs to MCAP.";
  }
  return error;
}

}  // namespace

void note_damage(const std::vector<OfferedFile>& files, const JobControl& control) {
  for (const OfferedFile& file : files) {
    if (file.kind != OfferedFile::Kind::Recording) continue;
    const auto log = open_log(file.path, control.log_options());
    if (!log) {
      control.note("warning: " + to_string(log.error()));
      continue;
    }
    if ((*log)->summary().complete) continue;
    for (const LogProblem& problem : (*log)->problems()) control.note("warning: " + to_string(problem.error));
    control.note(fmt::format(
        "{} is truncated: without its index the page has to read the whole file. `waymark recover {} "
        "output=whole.mcap` writes a file with an index",
        file.name, shell_word(file.path.string())));
  }
}

Result<std::vector<OfferedFile>> offered_by(const std::string& path, const JobControl& control) {
  std::error_code none;
  if (path.empty()) return std::vector<OfferedFile>{};
  if (path == "live" && !fs::exists(path, none))
    return fail(
        ErrorCode::InvalidArgument, "a live robot is shown by the verb that drives it", {},
        "For example `waymark run world=circuit24 driver=page view=true output=session`, or `waymark demo "
        "view=true`.");
  if (!fs::exists(path, none))
    return fail(ErrorCode::NotFound, "there is no such file or folder", {.source = path}, "Check the path.");
  if (fs::is_directory(path, none)) {
    std::vector<OfferedFile> left_out;
    std::vector<OfferedFile> files = files_of(path, left_out);
    for (const OfferedFile& file : left_out)
      control.note(fmt::format("{} is a link out of the folder and is not shown; to show it, give its target",
                               file.path.string()));
    if (files.empty())
      return fail(ErrorCode::NotFound, "no recording (.mcap) and no map.yaml in this folder",
                  {.source = path}, "Give a recording, the folder of a map, or a folder of `waymark demo`.");
    return files;
  }
  const std::string name = fs::path(path).filename().string();
  const FileKind kind = kind_of(path);
  if (kind == FileKind::Mcap) return std::vector<OfferedFile>{{name, path, OfferedFile::Kind::Recording}};
  const bool yaml = name.ends_with(".yaml") || name.ends_with(".yml");
  if (yaml && !is_recording(kind) && !wrong_kind(path, FileUse::Page))
    return std::vector<OfferedFile>{{name, path, OfferedFile::Kind::Text}};
  return tl::unexpected(not_shown(path, kind));
}

}  // namespace waymark
