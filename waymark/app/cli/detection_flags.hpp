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

/// The flags with which a verb chooses and tunes its detector: --family, --no-refine, and the sections
/// detector and refinement. Must stay where it is while the command line is parsed.
class DetectorFlags {
 public:
  /// `group`: of --family and --no-refine.
  DetectorFlags(Settings& settings, const char* group);

  /// Defaults, then the settings, then flags. Fails on an unknown family, a value out of range, and on
  /// options of the refinement with --no-refine.
  [[nodiscard]] Result<TagFinder> make() const;
  /// Whether any of them was given.
  [[nodiscard]] bool given() const;
  /// Fails when one of them is on the command line, where nothing is detected.
  [[nodiscard]] Status refuse_all(const std::string& why, const std::string& hint) const;

 private:
  const CLI::App& app_;
  std::vector<std::string> families_;
  bool no_refine_ = false;
  OptionFlags<DetectorOptions> detector_;
  OptionFlags<RefinementOptions> refinement_;
};

/// The flags with which a verb gives poses: --camera, --camera-name, --camera-size, --tag-size-m. Must stay
/// where it is while the command line is parsed.
class PoseFlags {
 public:
  explicit PoseFlags(CLI::App& verb);
  PoseFlags(const PoseFlags&) = delete;
  PoseFlags& operator=(const PoseFlags&) = delete;

  /// Nothing when no pose was asked for. Fails when only half of what is needed was given, on a file that
  /// cannot be read and on a size that cannot be.
  [[nodiscard]] Result<std::optional<PoseSetup>> make() const {
    return described_poses(words_.camera, words_.sizes);
  }
  /// Fails when one of them was given, where no pose is asked for.
  [[nodiscard]] Status refuse_all(const std::string& why, const std::string& hint) const;

 private:
  const CLI::App& app_;
  PoseWords words_{};
};

}  // namespace waymark::cli
