#include "waymark/app/common/image_files.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <glob.h>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 7> kImages = {".jpg", ".jpeg", ".png", ".pgm", ".ppm", ".pbm", ".pnm"};
template <std::size_t N>
bool has_suffix(const fs::path& path, const std::array<std::string_view, N>& suffixes) {
  std::string suffix = path.extension().string();
  for (char& c : suffix) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return std::find(suffixes.begin(), suffixes.end(), suffix) != suffixes.end();
}

Input failed(const std::string& source, ErrorCode code, std::string message, std::string hint = {}) {
  return {source, Error{code, std::move(message), {.source = source}, std::move(hint)}};
}

Input no_stream(const std::string& source) {
  return failed(source, ErrorCode::Unsupported, "cameras and streams are not supported by this build",
                "Record a video file first: ffmpeg -i SOURCE -t 10 walk.mp4");
}

/// Adds the images that `iterator` visits. Returns false if the folder cannot be read.
template <class Iterator>
bool collect(Iterator iterator, std::error_code& error, std::vector<std::string>& paths) {
  for (; !error && iterator != Iterator(); iterator.increment(error)) {
    std::error_code ignored;
    if (has_suffix(iterator->path(), kImages) && !iterator->is_directory(ignored)) {
      paths.push_back(iterator->path().string());
    }
  }
  return !error;
}

std::vector<Input> in_folder(const std::string& folder, bool recursive) {
  std::vector<std::string> paths;
  std::error_code error;
  const bool read = recursive ? collect(fs::recursive_directory_iterator(folder, error), error, paths)
                              : collect(fs::directory_iterator(folder, error), error, paths);
  if (read && paths.empty() && kind_of(folder) == FileKind::BagFolder) return {{folder, {}}};
  std::vector<Input> inputs;  // keeps images found before a read error
  if (!read)
    inputs.push_back(failed(folder, ErrorCode::Unreadable, "cannot read the folder: " + error.message()));
  if (read && paths.empty()) {
    inputs.push_back(failed(folder, ErrorCode::NotFound, "no image in this folder",
                            fmt::format("Looked for {}{}.", fmt::join(kImages, " "),
                                        recursive ? "" : "; set `recursive` to search subfolders too")));
  }
  std::sort(paths.begin(), paths.end());
  for (std::string& path : paths) inputs.push_back({std::move(path), {}});
  return inputs;
}

Input missing(const std::string& source) {
  std::vector<std::string> names;
  const fs::path path(source);
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code error;
  constexpr std::size_t kMaxNames = 10000;
  for (fs::directory_iterator it(folder, error); !error && it != fs::directory_iterator();
       it.increment(error)) {
    if (names.size() == kMaxNames) break;
    names.push_back(it->path().filename().string());
  }
  if (source.starts_with("/dev/video") || source == "v4l2")
    return failed(source, ErrorCode::NotFound, "no such file or folder",
                  "Name a camera with its kind, such as v4l2:/dev/video0; `waymark cameras` lists cameras.");
  const std::string nearest = nearest_word(path.filename().string(), names);
  std::string hint = "Check the path.";
  if (!nearest.empty())
    hint = fmt::format("Did you mean '{}'?", (path.parent_path() / nearest).string());
  else if (source.find(':') != std::string::npos)
    hint = "Check the path. The address of a camera begins with its kind, such as v4l2:/dev/video0.";
  return failed(source, ErrorCode::NotFound, "no such file or folder", hint);
}

std::vector<Input> of_pattern(const std::string& pattern) {
  glob_t found{};
  const int outcome = glob(pattern.c_str(), 0, nullptr, &found);
  std::vector<std::string> paths(found.gl_pathv, found.gl_pathv + (outcome == 0 ? found.gl_pathc : 0));
  globfree(&found);
  if (paths.empty()) return {failed(pattern, ErrorCode::NotFound, "nothing matches this pattern")};
  std::sort(paths.begin(), paths.end());  // glob() sorts by locale
  std::vector<Input> inputs;
  for (std::string& path : paths) {
    std::error_code ignored;
    if (!fs::is_directory(path, ignored)) inputs.push_back({std::move(path), {}});
  }
  if (inputs.empty()) return {failed(pattern, ErrorCode::NotFound, "only folders match this pattern")};
  return inputs;
}

std::vector<Input> of_source(const std::string& source, bool recursive) {
  std::error_code ignored;
  const fs::file_status status = fs::status(source, ignored);
  const bool exists = fs::exists(status);
  const bool is_stream =
      source.find("://") != std::string::npos || (exists && source.starts_with("/dev/video"));
  if (is_stream) return {no_stream(source)};
  if (fs::is_directory(status)) return in_folder(source, recursive);
  if (exists && !fs::is_regular_file(status) && !fs::is_fifo(status)) {
    return {failed(source, ErrorCode::Unsupported, "is a device or a socket, not an image")};
  }
  if (exists) return {{source, {}}};
  if (source.find_first_of("*?[") != std::string::npos) return of_pattern(source);
  return {missing(source)};
}

}  // namespace

std::vector<Input> find_inputs(const std::vector<std::string>& sources, bool recursive) {
  std::vector<Input> inputs;
  std::set<std::string> seen;
  for (const std::string& source : sources) {
    for (Input& input : of_source(source, recursive)) {
      const bool is_new = seen.insert(fs::path(input.path).lexically_normal().string()).second;
      if (is_new || input.error) inputs.push_back(std::move(input));
    }
  }
  return inputs;
}

}  // namespace waymark
