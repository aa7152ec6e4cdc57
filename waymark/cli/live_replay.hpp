#pragma once

#include <functional>
#include <memory>

#include "waymark/cli/live_steps.hpp"
#include "waymark/cli/replay_log.hpp"

namespace waymark::cli {

/// A replay of a robot that lives, with everything it stands on.
class LiveReplay {
 public:
  /// `on_step`: called with each decision before it is recorded.
  static Result<std::unique_ptr<LiveReplay>> make(const RobotSetup& setup, const ReplayJob& job,
                                                  const ReplayFiles& files, Console& console,
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

}  // namespace waymark::cli
