#pragma once

#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/plot/figure.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Fails where no file can be written into the folder, or it cannot be made. Leaves nothing behind.
[[nodiscard]] Status check_output_folder(const std::filesystem::path& folder);
/// The same of a folder that is not there yet, or empty.
[[nodiscard]] Status check_new_folder(const std::filesystem::path& folder);
/// The same of one file: its folder is there and may be written, and the name is none of a folder. Devices
/// are files as well.
[[nodiscard]] Status check_output_file(const std::filesystem::path& file);

/// The same of a file that is not there yet, unless it is to be replaced (`force`).
[[nodiscard]] Status check_new_file(const std::filesystem::path& file, bool replace);

/// Whether something stands there that is no regular file: a terminal, /dev/null, a pipe.
[[nodiscard]] bool is_device(const std::filesystem::path& path);

/// Moves what stands there under this name aside (NAME.1.yaml, or the next number that is free), unless it is
/// this text. The new name; empty where nothing moved.
[[nodiscard]] Result<std::string> move_aside(const std::filesystem::path& file, const std::string& text);

/// Files that get into a folder together or not at all: they are written beside it and put into place when
/// all are there. What stands there under their names moves aside: NAME.1.yaml, or the next number that is
/// free.
class StagedFolder {
 public:
  /// Makes the folder where it is not there.
  static Result<StagedFolder> open(const std::filesystem::path& folder);
  StagedFolder(StagedFolder&& other) noexcept;
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;
  StagedFolder& operator=(StagedFolder&&) = delete;
  /// Unless put_in_place() was called, everything is as it was.
  ~StagedFolder();

  /// Where the files are to be written.
  [[nodiscard]] const std::filesystem::path& path() const { return staged_; }
  /// What failed to be written there, said of the file where it belongs.
  [[nodiscard]] tl::unexpected<Error> failed(Error error) const;
  /// The number that put_in_place() gives to what moves aside.
  [[nodiscard]] int number_for(const std::vector<std::string>& older) const;
  /// `older` are names that move aside although no new file takes their place. What stays the same to the
  /// byte and is not among them stays where it is. The names that moved; after an error, none did.
  Result<std::vector<std::string>> put_in_place(const std::vector<std::string>& older);

 private:
  StagedFolder(std::filesystem::path folder, std::filesystem::path made);
  [[nodiscard]] std::vector<std::string> written() const;
  [[nodiscard]] std::vector<std::string> moving(const std::vector<std::string>& older) const;

  std::filesystem::path folder_{};
  std::filesystem::path made_{};  ///< the topmost folder that was not there; empty: it was
  std::filesystem::path staged_{};
};

/// "map.1.yaml" of "map.yaml".
[[nodiscard]] std::string numbered(const std::string& name, int number);

/// A recording that has just been begun: unless the robot said something, or keep() was called, it is removed
/// again, so that it does not stand in the way of the next attempt.
class FreshFile {
 public:
  /// Empty: no file.
  explicit FreshFile(std::string path) : path_(std::move(path)) {}
  FreshFile(const FreshFile&) = delete;
  FreshFile& operator=(const FreshFile&) = delete;
  ~FreshFile() {
    std::error_code ignored;
    if (!path_.empty() && !kept_ && std::filesystem::is_regular_file(path_, ignored))
      std::filesystem::remove(path_, ignored);
  }

  /// What was sent to the robot does not count.
  void receive(const Sample& sample) { kept_ = kept_ || !std::holds_alternative<StampedCommand>(sample); }
  void keep() { kept_ = true; }
  /// Nothing was driven, whatever the robot said.
  void discard() { kept_ = false; }

 private:
  std::string path_;
  bool kept_ = false;
};

/// Draws a figure and writes it beside `path` with each suffix (".svg", ".png"); their paths are added to
/// `files`.
[[nodiscard]] Status write_figure(const std::filesystem::path& path, const plot::Figure& figure,
                                  const std::vector<std::string>& suffixes, std::vector<std::string>& files);

}  // namespace waymark
