#pragma once

#include <memory>
#include <optional>
#include <string>

#include "waymark/localization/method.hpp"
#include "waymark/replay/pure_pursuit.hpp"
#include "waymark/replay/route_progress.hpp"
#include "waymark/replay/safety_limiter.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

struct ReplayOptions {
  double laps = 1;  ///< how often a closed route is driven
  PurePursuitOptions pursuit{};
  SafetyOptions safety{};
};

enum class ReplayState : std::uint8_t {
  Waiting,  ///< for the first estimate
  Refused,  ///< the start gate said no
  Driving,
  Stopped,  ///< the limiter stopped it; goes on when the reason is gone
  Finished,
};

/// What to send now, and why.
struct ReplayStep {
  ReplayState state = ReplayState::Waiting;
  VelocityCommand command{};
  std::optional<std::string> reason{};  ///< of a refusal or a stop
  std::optional<LocalizationEstimate> estimate{};
  std::optional<RouteProgress> progress{};
  double driven_m = 0;  ///< along the route since the start
};

/// The replay phase: estimate, follow, limit. Samples in stamp order; step() as often as commands are sent.
class Replayer {
 public:
  /// The map is for the keep-out about tags.
  Replayer(std::unique_ptr<LocalizationMethod> method, Route route, TagMap map, RobotModel robot,
           const ReplayOptions& options);

  void add(const TagFrame& frame);
  void add(const Odometry& odometry);
  /// The command for now. Time is an argument: the age of the newest odometry is measured against it.
  [[nodiscard]] ReplayStep step(SensorTime now);

  [[nodiscard]] int stops() const { return stops_; }

 private:
  void track(const LocalizationEstimate& estimate);
  [[nodiscard]] bool at_goal() const;

  std::unique_ptr<LocalizationMethod> method_;
  Route route_;
  TagMap map_;
  RobotModel robot_;
  ReplayOptions options_;
  ReplayState state_ = ReplayState::Waiting;
  std::optional<RouteProgress> progress_{};
  std::optional<SensorTime> newest_odometry_{};
  double driven_m_ = 0;
  VelocityCommand last_command_{};
  std::optional<SensorTime> last_step_{};
  std::string refusal_{};
  int stops_ = 0;
};

}  // namespace waymark
