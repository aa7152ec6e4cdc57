#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/cli/options_flags.hpp"
#include "waymark/app/cli/setup_flags.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark::cli {

/// The simulated camera and what it looks at: the sections camera and scene. Must stay where it is while the
/// command line is parsed.
class SceneFlags {
 public:
  SceneFlags(Settings& settings, Reach reach);

  /// The options, where there are pictures; without them one on the command line is refused.
  [[nodiscard]] Status apply(bool images, std::optional<DetectingCameraOptions>& pictures) const;
  /// What was given again for the command line of a simulated robot, with the flags of its setup, --images,
  /// and "--set SECTION.KEY=VALUE".
  [[nodiscard]] std::vector<std::string> as_words(const SetupFlags& setup, bool images) const;

 private:
  const Settings& settings_;
  OptionFlags<SceneCameraOptions> camera_;
  OptionFlags<SceneOptions> scene_;
};

/// The flags --images, --threads, --faults, and the camera and the scene. Must stay where it is while the
/// command line is parsed.
class PictureFlags {
 public:
  /// Without `detects` nothing is detected, and there is no --threads.
  PictureFlags(Settings& settings, Reach reach, bool detects = true);
  PictureFlags(const PictureFlags&) = delete;
  PictureFlags& operator=(const PictureFlags&) = delete;

  /// The setup, unless it failed, with the script of faults and what the flags say. Fails on flags of a
  /// simulated robot where the robot is a process.
  [[nodiscard]] Result<RobotSetup> apply(Result<RobotSetup> setup) const;

 private:
  const CLI::App& app_;
  SimulatedWords words_{};
  SceneFlags scene_;
};

}  // namespace waymark::cli
