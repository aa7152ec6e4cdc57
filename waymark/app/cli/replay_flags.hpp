#pragma once

#include <optional>

#include "waymark/app/cli/flags.hpp"
#include "waymark/app/replay/replay_route.hpp"

namespace waymark::cli {

/// The options of a replay: filter, controller, speed, alarms and limits. Must not move while the command
/// line is parsed.
class ReplayFlags {
 public:
  /// With SettingsOnly there are only options for the default method and controller. Use it for verbs that do
  /// not let users choose them.
  ReplayFlags(Settings& settings, Reach reach);

  /// Overwrites the job's options with those set by the user. Fails on options for a method or a controller
  /// that the job does not use.
  [[nodiscard]] Status apply(ReplayJob& job) const;

 private:
  [[nodiscard]] Status check(const ReplayJob& job) const;

  const CLI::App& app_;
  OptionFlags<RiekfOptions> filter_;
  std::optional<OptionFlags<AnchorOptions>> anchor_{};
  OptionFlags<FollowerOptions> follower_;
  OptionFlags<ActuatorOptions> actuators_;
  OptionFlags<ProfileOptions> profile_;
  std::optional<OptionFlags<PurePursuitOptions>> pursuit_{};
  std::optional<OptionFlags<GoToPoseOptions>> goal_{};
  OptionFlags<WatchOptions> watch_;
  OptionFlags<ConsistencyOptions> consistency_;
  OptionFlags<SafetyOptions> safety_;
};

}  // namespace waymark::cli
