#pragma once

#include <string>

#include "waymark/cli/options_flags.hpp"
#include "waymark/drivers/simulated/simulated_lap.hpp"

namespace waymark::cli {

/// The flags --images, --threads, --faults and those of the camera. Must stay where it is while the command
/// line is parsed.
class PictureFlags {
 public:
  explicit PictureFlags(CLI::App& app);
  PictureFlags(const PictureFlags&) = delete;
  PictureFlags& operator=(const PictureFlags&) = delete;

  /// Reads the script of faults and sets what the flags say.
  [[nodiscard]] Status apply(SimulatedStage& stage) const;

 private:
  bool images_ = false;
  int threads_;
  std::string faults_;
  OptionFlags<SceneCameraOptions> camera_;
  OptionFlags<SceneOptions> scene_;
};

}  // namespace waymark::cli
