#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "waymark/app/live/live_page.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/live/stop_key.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/runtime/viewer_input.hpp"

namespace waymark {

/// What viewers are shown of a session, of a lap that is taught, or of a replay. Without a feed nothing
/// happens.
class SessionViewers {
 public:
  explicit SessionViewers(LiveFeed* feed) : feed_(feed) {}

  void show_camera(const SimulatedSetup& setup);
  /// map.yaml, route.yaml and robot.yaml of the folder, those that are there; the map as shapes, too.
  void show_map(const std::filesystem::path& folder);
  void tell(const Operator& session, const OperatorInput& input);
  void tell(LiveStatus status);
  /// Hears each decision of a replay and shows estimates, what was compared with them, and progress. Only the
  /// newest is received.
  [[nodiscard]] std::function<void(const ReplayStep&)> watch(double goal_m);

 private:
  LiveFeed* feed_;
  double goal_m_ = 0;
  double driven_m_ = 0;
  std::optional<bool> certain_{};
  std::string halted_{};
};

/// One phase of the session by itself, as `waymark teach` and `waymark replay` run it, with its viewers.
class PhaseViewers {
 public:
  /// `keys_taken`: a driver reads the keys of the terminal itself.
  PhaseViewers(LiveFeed* feed, const SimulatedSetup& setup, OperatorState phase, bool keys_taken = false);
  /// What viewers and the space bar of the terminal want; this must live for as long as they are asked.
  [[nodiscard]] SessionRequests requests();
  [[nodiscard]] SessionViewers& viewers() { return viewers_; }

 private:
  void tell();
  SessionViewers viewers_;
  StopKey stop_key_;
  PhaseRequests requests_;
  bool shown_;
};

}  // namespace waymark
