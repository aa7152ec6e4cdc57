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
  /// Called with every sample, after the replayer has received it.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Called with every decision, before its command is sent.
  std::function<Status(SensorTime, const ReplayStep&)> on_step = [](SensorTime, const ReplayStep&) {
    return Status();
  };
  /// Called with messages about requests that have no effect, and about a restart of the robot.
  std::function<void(const std::string&)> on_message = [](const std::string&) {};
};

struct ReplaySessionOptions {
  double give_up_s = 5;  ///< time spent waiting or stopped after which the replay is aborted
  /// If all sensors are silent for longer than this, the robot stays stopped until resume(), so that an
  /// operator can check it.
  double ask_after_silence_s = 1;
};

/// Result of a drive.
struct LapEnd {
  bool finished = false;     ///< whether the driver was done or the replay reached its goal
  bool interrupted = false;  ///< whether it was ended from outside
  double lap_s = 0;          ///< duration on the robot's clock
};

/// Result of a replay, or its state so far.
struct ReplayEnd : LapEnd {
  ReplayState state = ReplayState::Waiting;  ///< the most recent state
  std::string reason{};                      ///< reason for a refusal or for the final stop
  bool given_up = false;                     ///< whether the replay was aborted because the robot was stopped
                                             ///< or waiting for too long
  bool timed_out = false;
  double driven_m = 0;  ///< distance along the route
  int stops = 0;
  int frames = 0;
  int frames_with_two_tags = 0;
  std::map<MissReason, int> missed_tags{};  ///< number of expected tags that were not found, for each reason
};

/// Runs a replay. Passes samples to the replayer, and ends when the goal is reached, after a refusal, or when
/// the replay is aborted.
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
  /// Implementation of RobotListener::expected.
  [[nodiscard]] std::vector<ExpectedTag> expected(const MountedCamera& camera, SensorTime stamp) const {
    return replayer_.expected(camera, stamp);
  }
  void receive_missed(std::vector<MissedTag> missed);
  template <class Frame, class Seen>
  void count(const Frame& frame, const std::vector<Seen>& seen);
  Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// Brakes, and keeps the robot stopped until resume(). The replay is not aborted while paused.
  void pause();
  /// Sets the pose of the robot and pauses.
  void restart_from(const GivenPose& given);
  /// Continues from the nearest point on the route that has not been passed yet.
  void resume();
  /// Callbacks that let this session drive a robot; set should_stop to end the session from outside.
  [[nodiscard]] RobotListener listener();
  /// The state so far.
  [[nodiscard]] ReplayEnd end() const;
  /// The result, combined with the result of the loop.
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
  std::string ended_by_{};  ///< reason given by the request that ended it
  bool paused_ = false;
  std::optional<Odometry> odometry_{};  ///< the newest odometry
  std::optional<Duration> goes_{};      ///< uptime when the robot last moved or was stopped intentionally
  /// To detect silence of the sensors: the newest timestamp, the one at the previous decision, and the uptime
  /// at which it changed.
  std::optional<SensorTime> newest_{};
  std::optional<SensorTime> newest_before_{};
  Duration received_at_{};
};

}  // namespace waymark
