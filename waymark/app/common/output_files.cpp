#include "waymark/app/common/output_files.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include <unistd.h>

#include <fmt/format.h>

#include "waymark/codecs/image_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/plot/render.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// The topmost folder in the path that does not exist; empty if the path exists.
fs::path first_missing(fs::path folder) {
  fs::path missing;
  std::error_code error;
  for (; !folder.empty() && !fs::exists(folder, error); folder = folder.parent_path()) missing = folder;
  return missing;
}

/// Removes the folder and its parents up to and including `made`, as long as they are empty.
void remove_empty(fs::path folder, const fs::path& made) {
  std::error_code error;
  for (; !made.empty() && !folder.empty() && !error; folder = folder.parent_path()) {
    fs::remove(folder, error);
    if (folder == made) return;
  }
}

bool same_bytes(const fs::path& a, const fs::path& b) {
  std::error_code error;
  if (fs::file_size(a, error) != fs::file_size(b, error) || error) return false;
  std::ifstream in_a(a, std::ios::binary);
  std::ifstream in_b(b, std::ios::binary);
  return in_a && in_b &&
         std::equal(std::istreambuf_iterator<char>(in_a), {}, std::istreambuf_iterator<char>(in_b));
}

/// Creates a uniquely named folder inside `folder`; empty if that fails.
fs::path folder_inside(const fs::path& folder) {
  std::string name = (folder / ".waymark-XXXXXX").string();
  return ::mkdtemp(name.data()) != nullptr ? fs::path(name) : fs::path();
}

/// Renames that can be undone.
class Renames {
 public:
  bool rename(const fs::path& from, const fs::path& to, std::error_code& error) {
    fs::rename(from, to, error);
    if (!error) done_.emplace_back(from, to);
    return !error;
  }
  void undo() {
    std::error_code ignored;
    for (auto it = done_.rbegin(); it != done_.rend(); ++it) fs::rename(it->second, it->first, ignored);
  }

 private:
  std::vector<std::pair<fs::path, fs::path>> done_;
};

/// The longest existing part of this path if it is not a folder; otherwise empty.
fs::path file_in_the_way(const fs::path& folder) {
  std::error_code error;
  fs::path part = folder;
  while (!part.empty() && part.has_relative_path() && !fs::exists(part, error)) part = part.parent_path();
  return part.empty() || !fs::exists(part, error) || fs::is_directory(part, error) ? fs::path() : part;
}

}  // namespace

std::string numbered(const std::string& name, int number) {
  const fs::path path(name);
  return fmt::format("{}.{}{}", path.stem().string(), number, path.extension().string());
}

Status check_output_folder(const fs::path& folder) {
  const Result<StagedFolder> staged = StagedFolder::open(folder);
  return staged ? Status() : tl::unexpected(staged.error());
}

Status check_new_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && (!fs::is_directory(folder, error) || !fs::is_empty(folder, error)))
    return fail(ErrorCode::Unwritable, "the folder already exists", {.source = folder.string()},
                "Name a folder that does not exist yet.");
  return check_output_folder(folder);
}

Status check_output_file(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  const Place place{.source = file.string()};
  if (fs::is_directory(status))
    return fail(ErrorCode::Unwritable, "the output is a folder", place, "Give a file name.");
  if (fs::exists(status) && !fs::is_regular_file(status)) return {};  // accepts devices and pipes
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  if (const fs::path in_the_way = file_in_the_way(folder); !in_the_way.empty())
    return fail(ErrorCode::Unwritable,
                fmt::format("the file cannot be written: {} is a file, not a folder", in_the_way.string()),
                place, "Name a file in another folder.");
  if (!fs::is_directory(folder, error))
    return fail(ErrorCode::Unwritable, "the file cannot be written: its folder does not exist", place,
                fmt::format("Create it first: mkdir -p {}.", folder.string()));
  const fs::path probe = folder_inside(folder);
  if (probe.empty())
    return fail(ErrorCode::Unwritable, "the file cannot be written: its folder is not writable", place,
                "Check its permissions and the free disk space.");
  fs::remove(probe, error);
  return {};
}

bool is_device(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored) && !fs::is_regular_file(path, ignored);
}

Status check_new_file(const fs::path& file, bool replace) {
  std::error_code ignored;
  if (!replace && fs::is_regular_file(file, ignored))
    return fail(ErrorCode::Unwritable, "the file already exists", {.source = file.string()},
                "Choose another `output`, or set `force` to replace the file.");
  return check_output_file(file);
}

Result<std::string> move_aside(const fs::path& file, const std::string& content) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return std::string();
  if (const auto existing = read_file(file, content.size() + 1); existing && *existing == content)
    return std::string();
  int number = 1;
  const auto aside = [&] { return file.parent_path() / numbered(file.filename().string(), number); };
  while (fs::exists(aside(), error)) ++number;
  fs::rename(file, aside(), error);
  if (!error) return aside().string();
  return fail(ErrorCode::Unwritable, "the existing file cannot be renamed to a backup: " + error.message(),
              {.source = file.string()}, "Choose another file name.");
}

Result<StagedFolder> StagedFolder::open(const fs::path& folder) {
  const fs::path made = first_missing(folder);
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && !fs::is_directory(folder, error)) error = std::make_error_code(std::errc::not_a_directory);
  StagedFolder staged(folder, made);
  if (error)
    return fail(ErrorCode::Unwritable, "cannot create the folder: " + error.message(),
                {.source = folder.string()}, "Choose another folder.");
  staged.staged_ = folder_inside(folder);
  if (staged.staged_.empty())
    return fail(ErrorCode::Unwritable, "the folder is not writable", {.source = folder.string()},
                "Check its permissions and the free disk space.");
  return staged;
}

StagedFolder::StagedFolder(fs::path folder, fs::path made)
    : folder_(std::move(folder)), made_(std::move(made)) {}

StagedFolder::StagedFolder(StagedFolder&& other) noexcept
    : folder_(std::move(other.folder_)),
      made_(std::exchange(other.made_, {})),
      staged_(std::exchange(other.staged_, {})) {}

StagedFolder::~StagedFolder() {
  std::error_code ignored;
  if (!staged_.empty()) fs::remove_all(staged_, ignored);
  remove_empty(folder_, made_);
}

tl::unexpected<Error> StagedFolder::failed(Error error) const {
  const fs::path source = error.place.source;
  if (source.parent_path() == staged_) error.place.source = (folder_ / source.filename()).string();
  return tl::unexpected(std::move(error));
}

std::vector<std::string> StagedFolder::written() const {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(staged_, error), end; !error && entry != end; entry.increment(error))
    names.push_back(entry->path().filename().string());
  std::ranges::sort(names);
  return names;
}

std::vector<std::string> StagedFolder::moving(const std::vector<std::string>& older) const {
  std::vector<std::string> names = older;
  for (const std::string& name : written()) {
    if (!same_bytes(staged_ / name, folder_ / name)) names.push_back(name);
  }
  std::ranges::sort(names);
  names.erase(std::ranges::unique(names).begin(), names.end());
  std::error_code ignored;
  std::erase_if(names, [&](const std::string& name) {
    return !fs::exists(fs::symlink_status(folder_ / name, ignored));
  });
  return names;
}

int StagedFolder::number_for(const std::vector<std::string>& older) const {
  const std::vector<std::string> names = moving(older);
  std::error_code ignored;
  const auto taken = [&](int number) {
    return std::ranges::any_of(names, [&](const std::string& name) {
      return fs::exists(folder_ / numbered(name, number), ignored);
    });
  };
  int number = 1;
  while (taken(number)) ++number;
  return number;
}

Result<std::vector<std::string>> StagedFolder::put_in_place(const std::vector<std::string>& older) {
  const int number = number_for(older);
  const std::vector<std::string> names = moving(older);
  Renames renames;
  std::error_code error;
  for (const std::string& name : names) {
    if (!error) renames.rename(folder_ / name, folder_ / numbered(name, number), error);
  }
  for (const std::string& name : written()) {
    if (!error) renames.rename(staged_ / name, folder_ / name, error);
  }
  if (!error) {
    made_.clear();
    return names;
  }
  renames.undo();
  return fail(ErrorCode::Unwritable, "the files cannot be moved to their destination: " + error.message(),
              {.source = folder_.string()});
}

Status write_figure(const std::filesystem::path& path, const plot::Figure& figure,
                    const std::vector<std::string>& suffixes, std::vector<std::string>& files) {
  constexpr double kDpi = 150;
  const Result<plot::Drawing> drawing = plot::draw_figure(figure);
  if (!drawing) return tl::unexpected(drawing.error());
  for (const std::string& suffix : suffixes) {
    const std::string file = std::filesystem::path(path).replace_extension(suffix).string();
    const Result<plot::FileFormat> format = plot::format_of(file);
    if (!format) return tl::unexpected(format.error());
    const Result<plot::Bytes> bytes = *format == plot::FileFormat::Pdf   ? plot::render_pdf({&*drawing, 1})
                                      : *format == plot::FileFormat::Svg ? plot::render_svg(*drawing)
                                                                         : plot::render_png(*drawing, kDpi);
    if (!bytes) return tl::unexpected(bytes.error());
    if (Status status = write_bytes(file, *bytes); !status) return status;
    files.push_back(file);
  }
  return {};
}

}  // namespace waymark
