#pragma once

#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "waymark/base/error.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark::cli {

/// The configuration file of verbs that detect: "detector:" and "refinement:", and below them their fields.
struct DetectConfig {
  DetectorOptions detector;
  RefinementOptions refinement;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.detector, Field{"detector", "Method that detects tags in a picture."});
    visit(self.refinement, Field{"refinement", "Method that refines the corners of detected tags."});
  }
};

/// The flags with which a verb chooses and tunes its detector: --family, --config, --no-refine, and one for
/// every field of DetectorOptions. Must stay where it is while the command line is parsed.
class DetectorFlags {
 public:
  explicit DetectorFlags(CLI::App& app);

  /// Defaults, then the configuration file, then flags. Fails on an unknown family or key, or a value out of
  /// range.
  [[nodiscard]] Result<TagFinder> make() const;
  /// Whether any of them was given.
  [[nodiscard]] bool given() const;

 private:
  std::vector<std::string> families_;
  std::string config_path_;
  bool no_refine_ = false;
  OptionFlags<DetectorOptions> detector_;
  OptionFlags<RefinementOptions> refinement_;
};

}  // namespace waymark::cli
