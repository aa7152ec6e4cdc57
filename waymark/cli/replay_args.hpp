#pragma once

#include <string>

#include "waymark/cli/page_flags.hpp"
#include "waymark/cli/picture_flags.hpp"
#include "waymark/cli/replay_flags.hpp"
#include "waymark/cli/setup_flags.hpp"
#include "waymark/live/replay_route.hpp"

namespace waymark::cli {

/// The flags of `waymark replay`. Must stay where it is while the command line is parsed.
struct ReplayArgs {
  explicit ReplayArgs(CLI::App& verb)
      : app(verb),
        settings(verb),
        setup(verb, {}, true, "robot.yaml of the map's folder, "),
        pictures(verb, settings, Reach::SettingsOnly),
        options(verb, settings, Reach::Flags) {
    add_flags(verb, live);
    add_to(verb);
  }

  const CLI::App& app;
  Settings settings;
  SetupFlags setup;
  LiveFlags live{};
  PictureFlags pictures;
  ReplayFlags options;
  ReplayJob job{};
  std::string method = "riekf";
  std::string controller = "follower";
  std::string folder;
  std::string calibration;
  bool json = false;

  void add_to(CLI::App& verb);
  /// The robot in its world, as the flags say; fails on flags that have no effect on it.
  [[nodiscard]] Result<RobotSetup> make_setup() const;
  /// The job, whose calibration is known, with the options that were given, which count more.
  [[nodiscard]] Result<ReplayJob> job_of(ReplayJob calibrated) const;
};

}  // namespace waymark::cli
