#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "waymark/cli/live_steps.hpp"

namespace waymark::cli {

/// A replay of a robot that lives, as it goes on.
class LiveReplay {
 public:
  /// `images`: how pictures are recorded (raw, jpeg; empty: not at all).
  LiveReplay(Replayer& replayer, std::optional<SampleRecorder>& recorder, std::string images, double goal_m,
             Console& console)
      : replayer_(replayer),
        recorder_(recorder),
        images_(std::move(images)),
        goal_m_(goal_m),
        console_(console),
        notes_(console) {}

  Status hear(const Sample& sample);
  /// Nothing when it is over: at the goal, refused, or stood for five seconds.
  Result<std::optional<VelocityCommand>> decide(Duration uptime, SensorTime now);
  /// It brakes and stands because somebody wants it to, for as long as that.
  void pause();
  /// It goes on from the nearest point of the route that it has not passed yet.
  void resume();
  [[nodiscard]] const std::vector<StationVisit>& visits() const { return notes_.visits(); }

  /// Hears every step.
  std::function<void(SensorTime, const ReplayStep&)> on_step = [](SensorTime, const ReplayStep&) {};
  SimulatedReplayEnd end{};
  Trajectory true_path{};
  double driven_m = 0;

 private:
  Replayer& replayer_;
  std::optional<SampleRecorder>& recorder_;
  std::string images_;
  double goal_m_;
  Console& console_;
  ReplayNotes notes_;
  bool paused_ = false;
  std::optional<Duration> last_driving_{};
};

/// The stage with the tags of the map, where its world is not known: for the recording and the judge.
[[nodiscard]] Stage as_known(const Stage& stage, const MapFile& map);
/// What came of it, judged where the truth is known.
[[nodiscard]] ReplayReport live_report(LiveReplay& replay, const Replayer& replayer, const Stage& known,
                                       const ReplayFiles& files);

}  // namespace waymark::cli
