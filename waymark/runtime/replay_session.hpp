#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/pipeline/replayer.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/runtime/session_request.hpp"
#include "waymark/samples/tags_in_view.hpp"

namespace waymark {

/// Callbacks of a ReplaySession; an error ends the replay.
struct ReplayListener {
  /// Every sample, after the replayer received it.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Every decision, before its command is sent.
  std::function<Status(SensorTime, const ReplayStep&)> on_step = [](SensorTime, const ReplayStep&) {
    return Status();
  };
  /// Messages about requests that have no effect, and about a restart of the robot.
  std::function<void(const std::string&)> on_message = [](const std::string&) {};
};

struct ReplaySessionOptions {
  double give_up_s = 5;  ///< time of waiting or being stopped after which the replay is aborted
  /// After a longer silence of all sensors the robot stays stopped until resume(), so that an operator can
  /// check it.
  double ask_after_silence_s = 1;
};

/// Result of a drive.
struct LapEnd {
  bool finished = false;     ///< the driver was done, or the replay reached its goal
  bool interrupted = false;  ///< ended from outside
  double lap_s = 0;          ///< by the clock of the robot
};

/// Result of a replay, or its state so far.
struct ReplayEnd : LapEnd {
  ReplayState state = ReplayState::Waiting;  ///< the last one
  std::string reason{};                      ///< reason of a refusal or of the final stop
  bool given_up = false;                     ///< stopped or waiting for too long
  bool timed_out = false;
  double driven_m = 0;  ///< along the route
  int stops = 0;
  int frames = 0;
  int frames_with_two_tags = 0;
  std::map<MissReason, int> missed_tags{};  ///< expected tags that were not found
};

/// Runs a replay: passes samples to the replayer, and ends at the goal, after a refusal, or when the replay
/// is aborted.
class ReplaySession {
 public:
  /// The replayer must outlive the session.
  ReplaySession(Replayer& replayer, ReplayListener listener, const ReplaySessionOptions& options = {},
                SessionRequests requests = no_requests())
      : replayer_(replayer),
        listener_(std::move(listener)),
        options_(options),
        requests_(std::move(requests)) {}

  Status receive(const Sample& sample);
  /// Implements RobotListener::expected.
  [[nodiscard]] std::vector<ExpectedTag> expected(const MountedCamera& camera, SensorTime stamp) const {
    return replayer_.expected(camera, stamp);
  }
  void receive_missed(std::vector<MissedTag> missed);
  template <class Frame, class Seen>
  void count(const Frame& frame, const std::vector<Seen>& seen);
  Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// Brakes, and keeps the robot stopped until resume(); the replay is not aborted meanwhile.
  void pause();
  /// Sets the pose of the robot and pauses.
  void restart_from(const GivenPose& given);
  /// Continues from the nearest point of the route that has not been passed yet.
  void resume();
  /// Callbacks that drive a robot with this session; set should_stop to end it from outside.
  [[nodiscard]] RobotListener listener();
  /// The state so far.
  [[nodiscard]] ReplayEnd end() const;
  /// The result, combined with that of the loop.
  [[nodiscard]] ReplayEnd end(const RobotLoopEnd& loop) const;

 private:
  void notice_jump(const Odometry& odometry);
  void pause_after_silence(Duration uptime);
  Result<DriverDecision> follow(Duration uptime, SensorTime now);

  Replayer& replayer_;
  ReplayListener listener_;
  ReplaySessionOptions options_;
  SessionRequests requests_;
  ReplayEnd end_{};
  TagsInView in_view_{};
  std::string ended_by_{};  ///< reason of a request that ended it
  bool paused_ = false;
  std::optional<Odometry> odometry_{};  ///< the newest
  std::optional<Duration> goes_{};      ///< uptime when it last moved, or was stopped on purpose
  /// Silence of the sensors: the newest stamp, that at the previous decision, and the uptime of the change.
  std::optional<SensorTime> newest_{};
  std::optional<SensorTime> newest_before_{};
  Duration received_at_{};
};

}  // namespace waymark
