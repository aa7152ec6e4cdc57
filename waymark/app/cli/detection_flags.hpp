#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "waymark/app/cli/flags.hpp"
#include "waymark/app/common/camera_description.hpp"
#include "waymark/base/error.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark::cli {

/// The flags that select and tune the detector: --family, --no-refine, and the sections detector and
/// refinement. Must not move while the command line is parsed.
class DetectorFlags {
 public:
  /// `group` is the help group that contains --family and --no-refine.
  DetectorFlags(Settings& settings, const char* group);

  /// Applies the defaults, then the settings, then the flags. Fails on an unknown family, on a value out of
  /// range, and on refinement options together with --no-refine.
  [[nodiscard]] Result<TagFinder> make() const;
  /// The families for which the finder from make() searches, to parse the tags in other flags. Fails on
  /// invalid families and detector options.
  [[nodiscard]] Result<std::vector<FamilyId>> families() const;
  /// Whether any of these flags or options was set.
  [[nodiscard]] bool given() const;
  /// Fails if any of them is on the command line. For verbs and modes that do not detect tags.
  [[nodiscard]] Status refuse_all(const std::string& why, const std::string& hint) const;

 private:
  const CLI::App& app_;
  std::vector<std::string> families_;
  bool no_refine_ = false;
  OptionFlags<DetectorOptions> detector_;
  OptionFlags<RefinementOptions> refinement_;
};

/// The flags for tag poses: --camera, --camera-name, --camera-size, --tag-size-m. Must not move while the
/// command line is parsed.
class PoseFlags {
 public:
  explicit PoseFlags(CLI::App& verb);
  PoseFlags(const PoseFlags&) = delete;
  PoseFlags& operator=(const PoseFlags&) = delete;

  /// Returns `nullopt` if none of the flags was set. Fails if only the camera or only the tag size was set,
  /// if the file cannot be read, or if a size is invalid. Only tags of `families` may have their own sizes.
  [[nodiscard]] Result<std::optional<PoseSetup>> make(SearchedFamilies families) const {
    return described_poses(words_.camera, words_.sizes, families);
  }
  /// Fails if any of them was set. For modes that do not compute poses.
  [[nodiscard]] Status refuse_all(const std::string& why, const std::string& hint) const;

 private:
  const CLI::App& app_;
  PoseRequest words_{};
};

}  // namespace waymark::cli
