#pragma once

#include <functional>
#include <memory>

#include "waymark/app/replay/replay_log.hpp"
#include "waymark/app/replay/replay_route.hpp"

namespace waymark {

/// A replay on a robot that is a process, with everything it stands on.
class LiveReplay {
 public:
  /// `on_step`: called with each decision before it is recorded.
  static Result<std::unique_ptr<LiveReplay>> make(const RobotSetup& setup, const ReplayJob& job,
                                                  const ReplayFiles& files, const JobControl& control,
                                                  std::function<void(const ReplayStep&)> on_step,
                                                  SessionRequests requests = no_requests());

  [[nodiscard]] ReplaySession& session() { return *session_; }
  /// Closes the recording, and says what came of it, judged where the truth is known.
  [[nodiscard]] Result<ReplayReport> finish(const ReplayEnd& end);

 private:
  LiveReplay(RobotSetup known, const ReplayFiles& files) : known_(std::move(known)), files_(files) {}

  RobotSetup known_;  ///< with the tags of the map, where its world is not known
  const ReplayFiles& files_;
  std::unique_ptr<Replayer> replayer_{};
  std::unique_ptr<ReplayLog> log_{};
  std::unique_ptr<ReplaySession> session_{};
};

/// replay_route() of a robot that is a process.
[[nodiscard]] Result<ReplayReport> replay_process(const RobotSetup& setup, const ReplayJob& job,
                                                  const JobControl& control);

}  // namespace waymark
