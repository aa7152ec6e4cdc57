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

/// Hears a robot that explores; an error ends the drive.
struct ExploreListener {
  /// Every sample, after explorer and localizer have had it.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Every decision with the estimate of its moment, before its command is sent.
  std::function<Status(SensorTime, const ExploreStep&, const std::optional<LocalizationEstimate>&)> on_step =
      [](SensorTime, const ExploreStep&, const std::optional<LocalizationEstimate>&) { return Status(); };
  /// At each decision: how far it is.
  std::function<void(const std::string&)> on_progress = [](const std::string&) {};
};

/// How exploring ended, or how it is so far.
struct ExploreEnd {
  bool finished = false;     ///< for as long as it was meant to
  bool interrupted = false;  ///< somebody wanted it to end
  double seconds = 0;        ///< since the robot was switched on
  std::string stands{};      ///< why the robot stood at the end; empty when it drove
  int turns = 0;
  std::map<TagId, int> seen{};  ///< tags of the map, and in how many pictures
};

/// A robot that wanders without a plan while it localises itself, for a given time.
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
  /// This session as what drives a robot: add to it who may stop it.
  [[nodiscard]] RobotListener listener();
  [[nodiscard]] ExploreEnd end() const;
  /// How it ended, where the loop did.
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
