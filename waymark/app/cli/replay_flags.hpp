#pragma once

#include <optional>

#include "waymark/app/cli/flags.hpp"
#include "waymark/app/replay/replay_route.hpp"

namespace waymark::cli {

/// The options of a replay: filter, controller, speed, alarms and limits. Must not move while the command
/// line is parsed.
class ReplayFlags {
 public:
  /// SettingsOnly: only options of the default method and controller, for verbs that do not offer the choice.
  ReplayFlags(Settings& settings, Reach reach);

  /// Overwrites the job's options with the given ones. Fails on options of a method or a controller that the
  /// job does not use.
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
