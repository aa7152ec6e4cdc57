#pragma once

#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/plot/figure.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Fails if no file can be written to the folder, or if the folder cannot be created. Leaves nothing behind.
[[nodiscard]] Status check_output_folder(const std::filesystem::path& folder);
/// The same for a folder that must be new or empty.
[[nodiscard]] Status check_new_folder(const std::filesystem::path& folder);
/// The same for one file. Its folder must exist and be writable, and the path must not be a folder. Devices
/// are accepted.
[[nodiscard]] Status check_output_file(const std::filesystem::path& file);

/// The same for a file that must not exist yet, unless `force` allows it to be replaced.
[[nodiscard]] Status check_new_file(const std::filesystem::path& file, bool replace);

/// Whether the path exists and is not a regular file, for example a terminal, /dev/null or a pipe.
[[nodiscard]] bool is_device(const std::filesystem::path& path);

/// Renames an existing file to a backup (NAME.1.yaml, or the next free number), unless this is its content.
/// Returns the new name; empty if nothing was renamed.
[[nodiscard]] Result<std::string> move_aside(const std::filesystem::path& file, const std::string& content);

/// Files that are either all written to a folder or not at all. They are written to a temporary folder and
/// moved once all are complete. Existing files with the same names are renamed to backups: NAME.1.yaml, or
/// the next free number.
class StagedFolder {
 public:
  /// Creates the folder if it does not exist.
  static Result<StagedFolder> open(const std::filesystem::path& folder);
  StagedFolder(StagedFolder&& other) noexcept;
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;
  StagedFolder& operator=(StagedFolder&&) = delete;
  /// Leaves the folder unchanged unless put_in_place() was called.
  ~StagedFolder();

  /// The folder to which the files should be written.
  [[nodiscard]] const std::filesystem::path& path() const { return staged_; }
  /// Converts a write error so that it names the final path of the file.
  [[nodiscard]] tl::unexpected<Error> failed(Error error) const;
  /// The number that put_in_place() will use for the backups.
  [[nodiscard]] int number_for(const std::vector<std::string>& older) const;
  /// Moves the files into the folder. The files in `older` are renamed to backups even if no new file
  /// replaces them. Other existing files are renamed only if their content differs. Returns the names of the
  /// files that were renamed. After an error the folder is unchanged.
  Result<std::vector<std::string>> put_in_place(const std::vector<std::string>& older);

 private:
  StagedFolder(std::filesystem::path folder, std::filesystem::path made);
  [[nodiscard]] std::vector<std::string> written() const;
  [[nodiscard]] std::vector<std::string> moving(const std::vector<std::string>& older) const;

  std::filesystem::path folder_{};
  std::filesystem::path made_{};  ///< topmost folder that open() created; empty if it created none
  std::filesystem::path staged_{};
};

/// Returns "map.1.yaml" for "map.yaml".
[[nodiscard]] std::string numbered(const std::string& name, int number);

/// A recording that has just been started. The file is removed unless the robot sent data or keep() was
/// called, so that it does not get in the way of the next attempt.
class FreshFile {
 public:
  /// There is no file if the path is empty.
  explicit FreshFile(std::string path) : path_(std::move(path)) {}
  FreshFile(const FreshFile&) = delete;
  FreshFile& operator=(const FreshFile&) = delete;
  ~FreshFile() {
    std::error_code ignored;
    if (!path_.empty() && !kept_ && std::filesystem::is_regular_file(path_, ignored))
      std::filesystem::remove(path_, ignored);
  }

  /// Commands sent to the robot do not count as data.
  void receive(const Sample& sample) { kept_ = kept_ || !std::holds_alternative<StampedCommand>(sample); }
  void keep() { kept_ = true; }
  /// Removes the file even if the robot sent data. Used when nothing was driven.
  void discard() { kept_ = false; }

 private:
  std::string path_;
  bool kept_ = false;
};

/// Draws a figure and writes it to `path` with each suffix (".svg", ".png") appended. Adds the paths to
/// `files`.
[[nodiscard]] Status write_figure(const std::filesystem::path& path, const plot::Figure& figure,
                                  const std::vector<std::string>& suffixes, std::vector<std::string>& files);

}  // namespace waymark
