#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "waymark/pipeline/localizer.hpp"
#include "waymark/replay/explore.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// Callbacks of an ExploreSession; an error ends the drive.
struct ExploreListener {
  /// Called with every sample, after the explorer and the localizer have received it.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Called with every decision and the current estimate, before the command is sent.
  std::function<Status(SensorTime, const ExploreStep&, const std::optional<LocalizationEstimate>&)> on_step =
      [](SensorTime, const ExploreStep&, const std::optional<LocalizationEstimate>&) { return Status(); };
  /// Called with the progress at each decision.
  std::function<void(const std::string&)> on_progress = [](const std::string&) {};
};

/// Result of an exploration, or its state so far.
struct ExploreEnd {
  bool finished = false;      ///< whether it ran for its full time
  bool interrupted = false;   ///< whether it was ended from outside
  double seconds = 0;         ///< time since the robot was switched on
  std::string halt_reason{};  ///< why the robot was stationary at the end; empty if it was moving
  int turns = 0;
  std::map<TagId, int> seen{};  ///< number of frames in which each map tag was observed
};

/// Runs a robot that explores while localising itself, for a given time.
class ExploreSession {
 public:
  ExploreSession(Explorer explorer, Localizer localizer, TagMap tags, double most_s,
                 ExploreListener listener = {})
      : explorer_(std::move(explorer)),
        localizer_(std::move(localizer)),
        tags_(std::move(tags)),
        most_s_(most_s),
        listener_(std::move(listener)) {}

  Status receive(const Sample& sample);
  Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// Callbacks that let this session drive a robot; set should_stop to end the session from outside.
  [[nodiscard]] RobotListener listener();
  [[nodiscard]] ExploreEnd end() const;
  /// The result, combined with the result of the loop.
  [[nodiscard]] ExploreEnd end(const RobotLoopEnd& loop) const;

 private:
  [[nodiscard]] std::string progress(Duration uptime, bool certain) const;

  Explorer explorer_;
  Localizer localizer_;
  TagMap tags_;
  double most_s_;
  ExploreListener listener_;
  ExploreEnd end_{};
};

}  // namespace waymark
