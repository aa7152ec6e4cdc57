#include <algorithm>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "waymark/recording/folder_copies.hpp"
#include "waymark/recording/rosbag2_log.hpp"
#include "waymark/recording/split_log.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// The little of a metadata.yaml that says which files belong to a bag.
struct BagMetadata {
  std::vector<std::string> files{};
  bool packed_messages = false;
};

std::string unquoted(std::string text) {
  const auto blank = [](char c) { return c == ' ' || c == '\r' || c == '\t'; };
  while (!text.empty() && blank(text.front())) text.erase(0, 1);
  while (!text.empty() && blank(text.back())) text.pop_back();
  const bool quoted =
      text.size() >= 2 && (text.front() == '"' || text.front() == '\'') && text.back() == text.front();
  return quoted ? text.substr(1, text.size() - 2) : text;
}

BagMetadata parse_metadata(std::istream& yaml) {
  BagMetadata metadata;
  bool listing = false;
  for (std::string line; std::getline(yaml, line);) {
    const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
    const std::string words = line.substr(begin);
    const bool item = words.starts_with("- ");
    if (listing && item) metadata.files.push_back(unquoted(words.substr(2)));
    if (!item) listing = words.starts_with("relative_file_paths:");
    if (words.starts_with("compression_mode:"))
      metadata.packed_messages =
          unquoted(words.substr(17)) == "MESSAGE" || unquoted(words.substr(17)) == "message";
  }
  return metadata;
}

bool is_bag_file(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.ends_with(".db3") || name.ends_with(".mcap") || name.ends_with(".db3.zstd") ||
         name.ends_with(".mcap.zstd");
}

/// A listed file lies beside the metadata, whatever path the recorder wrote.
std::optional<fs::path> find_file(const fs::path& folder, const std::string& listed) {
  const fs::path name = fs::path(listed).filename();
  std::error_code ignored;
  for (const std::string& packing : {std::string(), std::string(".zstd")}) {
    const fs::path candidate = folder / (name.string() + packing);
    if (fs::is_regular_file(candidate, ignored)) return candidate;
  }
  return std::nullopt;
}

Result<std::unique_ptr<MessageLog>> open_part(const fs::path& path, bool packed_messages,
                                              const LogOptions& options) {
  if (packed_messages && path.extension() == ".db3")
    return open_rosbag2_file(path, path.string(), true, options);
  return open_log(path, options);
}

/// The bag files that a folder holds, by name.
std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (is_bag_file(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

/// Those that the bag's metadata lists and that are there, in its order. The missing ones are damage.
std::vector<fs::path> listed_files(const fs::path& folder, const BagMetadata& metadata,
                                   LogProblems& problems) {
  std::vector<fs::path> files;
  for (const std::string& listed : metadata.files) {
    if (const auto file = find_file(folder, listed)) {
      files.push_back(*file);
    } else {
      problems.damages("rosbag2.missing_file", {Error{ErrorCode::NotFound,
                                                      "the bag lists this file, but it is not there",
                                                      {.source = (folder / listed).string()},
                                                      {}}});
    }
  }
  return files;
}

struct BagFiles {
  std::vector<fs::path> files{};
  bool listed = false;  ///< the metadata says that they belong together
};

/// The files of a bag folder that are there, in order.
BagFiles files_of(const fs::path& folder, BagMetadata& metadata, LogProblems& problems) {
  std::ifstream yaml(folder / "metadata.yaml");
  const bool there = yaml.is_open();
  if (there) metadata = parse_metadata(yaml);
  if (std::vector<fs::path> listed = listed_files(folder, metadata, problems); !listed.empty())
    return {std::move(listed), true};
  BagFiles found{files_in(folder), false};
  if (found.files.empty()) return found;
  problems.damages("rosbag2.no_metadata",
                   {Error{ErrorCode::NotFound,
                          there ? "the bag's metadata.yaml lists none of the files that are there"
                                : "the bag folder has no metadata.yaml: its recorder did not finish",
                          {.source = folder.string()},
                          "All its .db3 and .mcap files are read."}});
  return found;
}

}  // namespace

Result<std::unique_ptr<MessageLog>> open_bag_folder(const fs::path& folder, const LogOptions& options) {
  LogProblems problems;
  BagMetadata metadata;
  const auto [files, listed] = files_of(folder, metadata, problems);
  std::error_code ignored;
  if (files.empty() && fs::exists(folder / "map.yaml", ignored))
    return fail(ErrorCode::Unsupported, "this is the folder of a map, and no recording",
                {.source = folder.string()},
                "Give the recording that it was made of; a map goes after --map.");
  if (files.empty())
    return fail(
        ErrorCode::NotFound,
        "no bag in this folder: neither a metadata.yaml with files that are there, nor a .db3 or .mcap file",
        {.source = folder.string()});
  std::vector<std::unique_ptr<MessageLog>> parts;
  for (const fs::path& file : files) {
    Result<std::unique_ptr<MessageLog>> part = open_part(file, metadata.packed_messages, options);
    if (part) {
      parts.push_back(std::move(*part));
    } else {
      problems.damages("rosbag2.file", {part.error()});
    }
  }
  if (parts.empty()) return tl::unexpected(problems.list().back().error);
  if (!listed) {  // nobody says that they belong together
    if (Status status = take_copies_out(parts, problems); !status) return tl::unexpected(status.error());
  }
  return join_logs(std::move(parts), std::move(problems));
}

}  // namespace waymark
