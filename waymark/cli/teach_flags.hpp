#pragma once

#include "waymark/cli/live_steps.hpp"
#include "waymark/cli/live_view.hpp"
#include "waymark/cli/picture_flags.hpp"
#include "waymark/cli/stage_flags.hpp"

namespace waymark::cli {

/// The flags of `waymark teach`. Must stay where it is while the command line is parsed.
struct TeachArgs {
  explicit TeachArgs(CLI::App& verb)
      : app(verb), settings(verb), stage(verb, {}, true), pictures(verb, settings, Reach::SettingsOnly) {
    add_flags(verb, live);
  }

  const CLI::App& app;
  Settings settings;
  StageFlags stage;
  PictureFlags pictures;
  TeachJob job{};
  const CLI::Option* speed = nullptr;
  LoneAnchorFlags anchor{};
  LiveFlags live{};
  bool json = false;

  void add_to(CLI::App& verb);
  /// The robot in its world, as the flags say.
  [[nodiscard]] Result<Stage> make_stage() const;
  /// Fails on what this robot cannot do, and on flags that have no effect.
  [[nodiscard]] Status check(const Stage& on) const;
  /// With the usual speed, or what the robot can, where none was given.
  [[nodiscard]] TeachJob job_of(const Stage& on) const;
};

}  // namespace waymark::cli
