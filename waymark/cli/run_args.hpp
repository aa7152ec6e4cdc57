#pragma once

#include <string>

#include "waymark/cli/page_flags.hpp"
#include "waymark/cli/picture_flags.hpp"
#include "waymark/cli/replay_flags.hpp"
#include "waymark/cli/setup_flags.hpp"
#include "waymark/live/run_session.hpp"

namespace waymark::cli {

/// The flags of `waymark run`. Must stay where it is while the command line is parsed.
struct RunArgs {
  explicit RunArgs(CLI::App& verb)
      : app(verb),
        settings(verb),
        setup(verb, {}, true),
        scene(verb, settings, Reach::SettingsOnly),
        options(verb, settings, Reach::SettingsOnly) {
    add_flags(verb, live);
    add_to(verb);
  }

  const CLI::App& app;
  Settings settings;
  SetupFlags setup;
  SceneFlags scene;
  ReplayFlags options;
  LiveFlags live{};
  CLI::Option* driver = nullptr;
  LoneAnchor anchor;
  SessionJob job{};
  std::string folder;
  std::string calibration;
  bool images = false;
  double pace = 1;
  bool json = false;

  void add_to(CLI::App& verb);
  /// The robot in its world, a process in any case; fails on flags that have no effect on it.
  [[nodiscard]] Result<RobotSetup> make_setup() const;
};

}  // namespace waymark::cli
