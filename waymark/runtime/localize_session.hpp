#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "waymark/pipeline/localizer.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/runtime/session_request.hpp"

namespace waymark {

/// Hears a robot that is localised; an error ends the session.
struct LocalizeListener {
  /// Every sample, after the localizer has had it.
  std::function<Status(const Sample&)> on_sample = [](const Sample&) { return Status(); };
  /// Every observation of a mapped tag beside what was expected of it.
  std::function<Status(const NisRecord&)> on_comparison = [](const NisRecord&) { return Status(); };
  /// Every estimate with a newer stamp than the last one, certain or not.
  std::function<Status(const LocalizationEstimate&)> on_estimate = [](const LocalizationEstimate&) {
    return Status();
  };
  /// LocalizeSessionOptions::report_every of the robot's time: the newest estimate; nothing while there is
  /// none, or no newer one came for LocalizeSessionOptions::silence_s.
  std::function<void(SensorTime, const std::optional<LocalizationEstimate>&)> on_report =
      [](SensorTime, const std::optional<LocalizationEstimate>&) {};
  std::function<void(const std::string&)> on_words = [](const std::string&) {};
};

struct LocalizeSessionOptions {
  Duration report_every = std::chrono::seconds(1);
  double most_s = std::numeric_limits<double>::infinity();  ///< then it is over
  /// After so long without odometry, or without tags or pictures, the listener is told, once each time.
  double silence_s = 2;
};

/// How localisation ended.
struct LocalizeEnd {
  bool finished = false;     ///< for as long as it was meant to, or somebody ended it by a button
  bool interrupted = false;  ///< by a signal
  double seconds = 0;        ///< by the robot's clock
};

/// A robot that somebody else drives, and is localised meanwhile: for RobotLoopOptions::listen_only, because
/// what this session decides is zero.
class LocalizeSession {
 public:
  LocalizeSession(Localizer localizer, LocalizeListener listener, SessionRequests requests = no_requests(),
                  const LocalizeSessionOptions& options = {})
      : localizer_(std::move(localizer)),
        listener_(std::move(listener)),
        requests_(std::move(requests)),
        options_(options) {}

  Status receive(const Sample& sample);
  Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// This session as what hears a robot: add to it who may end it.
  [[nodiscard]] RobotListener listener();

  [[nodiscard]] Localizer& localizer() { return localizer_; }
  /// How it ended, where the loop did.
  [[nodiscard]] LocalizeEnd end(const RobotLoopEnd& loop) const;

 private:
  struct Stream {
    const char* name;
    bool received = false;  ///< since the last decision
    bool silence_reported = false;
    Duration last{};
    bool ever_received = false;
  };
  void restart_from(const GivenPose& given);
  void notice_silence(Stream& stream, Duration uptime) const;
  void notice_foreign_tags(Duration uptime);

  Localizer localizer_;
  LocalizeListener listener_;
  SessionRequests requests_;
  LocalizeSessionOptions options_;
  std::vector<Stream> streams_ = {{.name = "odometry"}, {.name = "tags or pictures"}};
  std::optional<SensorTime> estimated_{};  ///< stamp of the newest estimate
  bool estimating_ = false;                ///< there is a newer one since the last decision
  Duration estimated_at_{};                ///< uptime of the decision after it
  std::set<TagId> tags_{};                 ///< some that were seen before the first estimate
  std::optional<Duration> tags_since_{};
  bool foreign_tags_reported_ = false;
  std::optional<SensorTime> next_report_{};
  bool finished_ = false;
};

}  // namespace waymark
