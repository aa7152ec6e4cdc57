#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "waymark/cli/live_replay.hpp"
#include "waymark/cli/live_view.hpp"
#include "waymark/cli/page_pilot.hpp"
#include "waymark/cli/stop_key.hpp"

namespace waymark::cli {

/// What viewers are told of a story, of a lap that is taught, or of a replay. Without a feed nothing happens.
class StoryViewers {
 public:
  explicit StoryViewers(LiveFeed* feed) : feed_(feed) {}

  void show_camera(const SimulatedStage& stage);
  /// map.yaml, route.yaml and robot.yaml of the folder, those that are there; the map as shapes, too.
  void show_map(const std::filesystem::path& folder);
  void tell(const Operator& story, const Pilot& pilot);
  void tell(LiveStatus status);
  /// Hears each decision of a replay and shows estimates, what was compared with them, and progress. Only the
  /// newest is heard.
  [[nodiscard]] std::function<void(const ReplayStep&)> watch(double goal_m);

 private:
  LiveFeed* feed_;
  double goal_m_ = 0;
  double driven_m_ = 0;
  std::optional<bool> certain_{};
  std::string halted_{};
};

/// One phase of the story by itself, as `waymark teach` and `waymark replay` run it, with its viewers.
class PhaseViewers {
 public:
  /// `keys_taken`: a driver reads the keys of the terminal itself.
  PhaseViewers(LiveFeed* feed, const SimulatedStage& stage, OperatorState phase, bool keys_taken = false);
  /// What viewers and the space bar of the terminal want, and what becomes of the command: nothing where they
  /// end the phase. Go pauses a replay and ends a lap.
  struct Wish {
    bool over = false;
    bool stand = false;
    bool stop_key = false;        ///< it is over because of the space bar
    std::optional<bool> pause{};  ///< it changed: pause, or go on
  };
  Wish hear(Duration uptime);
  [[nodiscard]] StoryViewers& viewers() { return viewers_; }

 private:
  void tell();
  StoryViewers viewers_;
  std::optional<PageOrders> orders_{};
  StopKey stop_key_;
  OperatorState phase_;
};

}  // namespace waymark::cli
