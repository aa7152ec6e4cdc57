#include "waymark/jobs/migrate_files.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/config/calibration_file.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/config/route_file.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kMostBytes = 256U << 20U;  // above what each of the readers takes

struct Migrated {
  MigratedFile file{};
  fs::path from{};
  std::string text{};  ///< where it is rewritten
};

constexpr std::string_view kFormat = "format: waymark-";

/// The line that names a format of ours and its version; empty where there is none.
std::string_view format_line_of(std::string_view text) {
  for (std::size_t begin = 0; begin < text.size();) {
    const std::string_view line = text.substr(begin, text.find('\n', begin) - begin);
    if (line.starts_with(kFormat)) return line;
    begin += line.size() + 1;
  }
  return {};
}

/// The word between "format: waymark-" and the number of its version; else empty.
std::string kind_of(std::string_view text) {
  const std::string_view line = format_line_of(text);
  return line.empty() ? "" : std::string(line.substr(kFormat.size(), line.rfind('-') - kFormat.size()));
}

/// The text without the digits of its numbers and checksums: equal for two texts of one format that state the
/// same things, however their numbers are rounded.
std::string without_numbers(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef+-.";
  std::string rest;
  for (const char c : text) {
    if (kDigits.find(c) == std::string_view::npos) rest += c;
  }
  return rest;
}

bool same_form(std::string_view text, std::string_view other) {
  return format_line_of(text) == format_line_of(other) && without_numbers(text) == without_numbers(other);
}

template <class Parse>
Result<std::string> written_again(Parse parse, const std::string& text, const fs::path& path) {
  const auto value = parse(text, path.string());
  if (!value) return tl::unexpected(value.error());
  return to_yaml(*value);
}

/// The file in today's form; as it is where it has no form of ours.
Result<Migrated> migrate(const fs::path& path, const std::string& name) {
  Migrated done{{.name = name, .kind = "other"}, path, {}};
  std::error_code error;
  if (!fs::is_regular_file(path, error)) {
    done.file.done = MigratedFile::Done::LeftOut;
    return done;
  }
  if (path.extension() != ".yaml") return done;
  const Result<std::string> text = read_file(path, kMostBytes);
  if (!text) return tl::unexpected(text.error());
  const std::string kind = kind_of(*text);
  Result<std::string> now;
  if (kind == "map") {
    now = written_again(parse_map, *text, path);
  } else if (kind == "route") {
    now = written_again(parse_route, *text, path);
  } else if (kind == "calibration") {
    now = written_again(parse_calibration, *text, path);
  } else {
    constexpr std::array<std::string_view, 3> kOurs = {"map.yaml", "route.yaml", "calibration.yaml"};
    if (std::ranges::find(kOurs, path.filename().string()) != kOurs.end())
      done.file.done = MigratedFile::Done::CopiedWithoutFormat;
    return done;
  }
  if (!now) return tl::unexpected(now.error());
  done.file.kind = kind;
  if (!same_form(*now, *text)) done.file.done = MigratedFile::Done::Rewritten;
  done.text = std::move(*now);
  return done;
}

/// All below the folder but the folders themselves; of a file, that file. Links to folders are not followed.
Result<std::vector<fs::path>> files_of(const fs::path& input) {
  std::error_code error;
  if (fs::is_regular_file(input, error)) return std::vector{input};
  std::vector<fs::path> paths;
  for (fs::recursive_directory_iterator it(input, error), end; !error && it != end; it.increment(error)) {
    std::error_code unknown;  // of a broken link: no folder
    if (it->is_symlink(unknown) || !it->is_directory(unknown)) paths.push_back(it->path());
  }
  if (error) return fail(ErrorCode::Unreadable, error.message(), {.source = input.string()});
  if (paths.empty()) return fail(ErrorCode::Unreadable, "holds no file", {.source = input.string()});
  std::ranges::sort(paths);
  return paths;
}

/// Fails where the output would lie inside of what is read.
Status check_apart(const MigrateJob& job) {
  std::error_code error;
  const fs::path input = fs::weakly_canonical(job.input, error);
  const fs::path output = fs::weakly_canonical(job.output, error);
  const fs::path way = output.lexically_relative(input);
  if (error || way.empty() || way == "." || *way.begin() == "..") return {};
  return fail(ErrorCode::InvalidArgument, "this folder lies inside the one that is read",
              {.source = job.output.string()}, "Name a folder beside it.");
}

Status make_empty_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && fs::is_empty(folder, error) && !error) return {};
  return fail(ErrorCode::Unwritable, error ? error.message() : "the folder is not empty",
              {.source = folder.string()}, "Name a folder that is not there yet.");
}

Status write(const Migrated& done, const fs::path& folder) {
  if (done.file.done == MigratedFile::Done::LeftOut) return {};
  const fs::path to = folder / done.file.name;
  std::error_code error;
  fs::create_directories(to.parent_path(), error);
  if (error) return fail(ErrorCode::Unwritable, error.message(), {.source = to.string()});
  if (done.file.done == MigratedFile::Done::Rewritten) return write_text_file(to, done.text);
  fs::copy_file(done.from, to, error);
  if (error) return fail(ErrorCode::Unwritable, error.message(), {.source = to.string()});
  return {};
}

}  // namespace

Result<std::vector<MigratedFile>> migrate_files(const MigrateJob& job) {
  if (Status apart = check_apart(job); !apart) return tl::unexpected(apart.error());
  const Result<std::vector<fs::path>> paths = files_of(job.input);
  if (!paths) return tl::unexpected(paths.error());
  const bool one_file = paths->front() == job.input;
  std::vector<Migrated> all;
  for (const fs::path& path : *paths) {
    Result<Migrated> done =
        migrate(path, (one_file ? path.filename() : path.lexically_relative(job.input)).string());
    if (!done) return tl::unexpected(done.error());
    all.push_back(std::move(*done));
  }
  if (Status status = make_empty_folder(job.output); !status) return tl::unexpected(status.error());
  std::vector<MigratedFile> files;
  for (const Migrated& done : all) {
    if (Status status = write(done, job.output); !status) return tl::unexpected(status.error());
    files.push_back(done.file);
  }
  return files;
}

namespace {

std::string_view word_of(MigratedFile::Done done) {
  switch (done) {
    case MigratedFile::Done::Copied:
      return "copied";
    case MigratedFile::Done::Rewritten:
      return "rewritten";
    case MigratedFile::Done::CopiedWithoutFormat:
      return "copied: no line in it begins with `format: waymark-`";
    case MigratedFile::Done::LeftOut:
      break;
  }
  return "left out: no file, or a link to a folder";
}

}  // namespace

std::string to_text(const MigratedFile& file) {
  return fmt::format("{:<24} {:<12} {}\n", file.name, file.kind, word_of(file.done));
}

nlohmann::ordered_json to_json(const MigratedFile& file) {
  return {{"name", file.name}, {"kind", file.kind}, {"done", word_of(file.done)}};
}

}  // namespace waymark
