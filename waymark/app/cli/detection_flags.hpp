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
  /// `group`: the help group of --family and --no-refine.
  DetectorFlags(Settings& settings, const char* group);

  /// Applies defaults, then the settings, then flags. Fails on an unknown family, a value out of range, and
  /// on options of the refinement with --no-refine.
  [[nodiscard]] Result<TagFinder> make() const;
  /// Whether any of these flags or options was given.
  [[nodiscard]] bool given() const;
  /// Fails if one of them is on the command line. For verbs and modes without detection.
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

  /// Nothing if no flag was given. Fails if only the camera or only the tag size was given, on an unreadable
  /// file and on an invalid size.
  [[nodiscard]] Result<std::optional<PoseSetup>> make() const {
    return described_poses(words_.camera, words_.sizes);
  }
  /// Fails if one of them was given. For modes without poses.
  [[nodiscard]] Status refuse_all(const std::string& why, const std::string& hint) const;

 private:
  const CLI::App& app_;
  PoseRequest words_{};
};

}  // namespace waymark::cli
