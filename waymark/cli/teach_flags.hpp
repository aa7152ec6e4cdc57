#pragma once

#include "waymark/cli/page_flags.hpp"
#include "waymark/cli/picture_flags.hpp"
#include "waymark/cli/setup_flags.hpp"
#include "waymark/live/inputs.hpp"
#include "waymark/live/teach_lap.hpp"

namespace waymark::cli {

/// The flags of `waymark teach`. Must stay where it is while the command line is parsed.
struct TeachArgs {
  explicit TeachArgs(CLI::App& verb)
      : app(verb), settings(verb), setup(verb, {}, true), pictures(verb, settings, Reach::SettingsOnly) {
    add_flags(verb, live);
    add_to(verb);
  }

  const CLI::App& app;
  Settings settings;
  SetupFlags setup;
  PictureFlags pictures;
  TeachJob job{};
  const CLI::Option* speed = nullptr;
  LoneAnchor anchor{};
  LiveFlags live{};
  bool json = false;

  void add_to(CLI::App& verb);
  /// The robot in its world, as the flags say.
  [[nodiscard]] Result<RobotSetup> make_setup() const;
  /// Fails on what this robot cannot do, and on flags that have no effect.
  [[nodiscard]] Status check(const RobotSetup& on) const;
  /// With the usual speed, or what the robot can, where none was given.
  [[nodiscard]] TeachJob job_of(const RobotSetup& on) const;
};

}  // namespace waymark::cli
