#pragma once

#include <limits>

#include "waymark/runtime/lap_driver.hpp"
#include "waymark/runtime/lap_monitor.hpp"
#include "waymark/runtime/replay_session.hpp"
#include "waymark/runtime/session_request.hpp"

namespace waymark {

struct TeachSessionOptions {
  /// After so long without odometry or pictures the listener is told. Infinite: never.
  double silence_s = std::numeric_limits<double>::infinity();
};

/// A lap that is driven once, as it goes on: the driver decides, everything is listened to, and zero is sent
/// when the lap is over.
class TeachSession {
 public:
  /// The driver outlives the session.
  TeachSession(LapDriver& driver, LapMonitor lap, SessionRequests requests = no_requests(),
               const TeachSessionOptions& options = {})
      : driver_(driver), lap_(std::move(lap)), requests_(std::move(requests)), options_(options) {}

  Status receive(const Sample& sample);
  Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// This session as what drives a robot: add to it who may stop it.
  [[nodiscard]] RobotListener listener();

  [[nodiscard]] const LapMonitor& lap() const { return lap_; }
  /// Whether the lap is over: the driver was done, or somebody ended it.
  [[nodiscard]] bool finished() const { return finished_; }
  /// How it ended, where the loop did.
  [[nodiscard]] LapEnd end(const RobotLoopEnd& loop) const;

 private:
  struct Stream {
    bool received = false;  ///< since the last decision
    bool said = false;
    Duration last{};
    bool heard = false;  ///< ever
  };
  void notice_silence(Stream& stream, Duration uptime, const char* what);

  LapDriver& driver_;
  LapMonitor lap_;
  SessionRequests requests_;
  TeachSessionOptions options_;
  Stream odometry_{};
  Stream camera_{};
  bool finished_ = false;
};

}  // namespace waymark
