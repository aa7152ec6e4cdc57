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
  /// Every sample, after explorer and localizer received it.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Every decision with the current estimate, before its command is sent.
  std::function<Status(SensorTime, const ExploreStep&, const std::optional<LocalizationEstimate>&)> on_step =
      [](SensorTime, const ExploreStep&, const std::optional<LocalizationEstimate>&) { return Status(); };
  /// Progress, at each decision.
  std::function<void(const std::string&)> on_progress = [](const std::string&) {};
};

/// Result of exploration, or its state so far.
struct ExploreEnd {
  bool finished = false;      ///< it ran for its full time
  bool interrupted = false;   ///< it was ended from outside
  double seconds = 0;         ///< since the robot was switched on
  std::string halt_reason{};  ///< why the robot was stopped at the end; empty if it moved
  int turns = 0;
  std::map<TagId, int> seen{};  ///< number of frames with each map tag
};

/// Runs a robot that explores and localises itself for a given time.
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
  /// Callbacks that drive a robot with this session; set should_stop to end it from outside.
  [[nodiscard]] RobotListener listener();
  [[nodiscard]] ExploreEnd end() const;
  /// The result, combined with that of the loop.
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
