#pragma once

#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "waymark/app/cli/options_flags.hpp"
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

}  // namespace waymark::cli
