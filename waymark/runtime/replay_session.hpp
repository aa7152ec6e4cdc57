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

/// Hears a replay as it is driven; an error ends it.
struct ReplayListener {
  /// Every sample, after the replayer has had it.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Every decision, before its command is sent.
  std::function<Status(SensorTime, const ReplayStep&)> on_step = [](SensorTime, const ReplayStep&) {
    return Status();
  };
  /// What somebody asked for and cannot have, and what looks like a restarted robot.
  std::function<void(const std::string&)> on_words = [](const std::string&) {};
};

struct ReplaySessionOptions {
  double give_up_s = 5;  ///< a robot that waits or stands stopped for so long is given up
  /// After a longer silence of all sensors the robot stands until somebody has looked: resume().
  double ask_after_silence_s = 1;
};

/// How a drive ended.
struct LapEnd {
  bool finished = false;     ///< the driver was done, or the replay at its goal
  bool interrupted = false;  ///< somebody wanted it to end
  double lap_s = 0;          ///< by the robot's clock
};

/// How a replay ended, or how it is so far.
struct ReplayEnd : LapEnd {
  ReplayState state = ReplayState::Waiting;  ///< the last one
  std::string reason{};                      ///< of a refusal, or of the stop that was not overcome
  bool given_up = false;                     ///< it stood or waited for too long
  bool timed_out = false;
  double driven_m = 0;  ///< along the route
  int stops = 0;
  int frames = 0;
  int frames_with_two_tags = 0;
  std::map<MissReason, int> missed_tags{};  ///< that should have been in view and were not found
};

/// A replay as it goes on: hands the samples to the replayer, and knows when it is over: at the goal,
/// refused, or given up.
class ReplaySession {
 public:
  /// The replayer outlives the session.
  ReplaySession(Replayer& replayer, ReplayListener listener, const ReplaySessionOptions& options = {},
                SessionRequests requests = no_requests())
      : replayer_(replayer),
        listener_(std::move(listener)),
        options_(options),
        requests_(std::move(requests)) {}

  Status receive(const Sample& sample);
  /// See RobotListener.
  [[nodiscard]] std::vector<ExpectedTag> expected(const MountedCamera& camera, SensorTime stamp) const {
    return replayer_.expected(camera, stamp);
  }
  void receive_missed(std::vector<MissedTag> missed);
  template <class Frame, class Seen>
  void count(const Frame& frame, const std::vector<Seen>& seen);
  Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// It brakes and stands because somebody wants it to, for as long as that; it is not given up meanwhile.
  void pause();
  /// Somebody says where the robot is: as pause().
  void restart_from(const GivenPose& given);
  /// It goes on from the nearest point of the route that it has not passed yet.
  void resume();
  /// This session as what drives a robot: add to it who may stop it.
  [[nodiscard]] RobotListener listener();
  /// How it is so far.
  [[nodiscard]] ReplayEnd end() const;
  /// How it ended, where the loop did.
  [[nodiscard]] ReplayEnd end(const RobotLoopEnd& loop) const;

 private:
  void notice_jump(const Odometry& odometry);
  void ask_after_silence(Duration uptime);
  Result<DriverDecision> follow(Duration uptime, SensorTime now);

  Replayer& replayer_;
  ReplayListener listener_;
  ReplaySessionOptions options_;
  SessionRequests requests_;
  ReplayEnd end_{};
  TagsInView in_view_{};
  std::string ended_by_{};  ///< a request, in words
  bool paused_ = false;
  std::optional<Odometry> odometry_{};  ///< the newest
  std::optional<Duration> goes_{};      ///< when it last drove, or was meant to stand
  /// What sensors said: the newest stamp, that of the decision before, and when that was.
  std::optional<SensorTime> newest_{};
  std::optional<SensorTime> newest_before_{};
  Duration received_at_{};
};

}  // namespace waymark
