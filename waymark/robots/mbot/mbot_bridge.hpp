#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "waymark/recording/lcm/mbot_samples.hpp"
#include "waymark/robots/mbot/lcm_link.hpp"
#include "waymark/robots/process/drop_reports.hpp"
#include "waymark/robots/process/robot_clock.hpp"
#include "waymark/robots/process/robot_messages.hpp"

namespace waymark {

struct MbotBridgeOptions {
  std::string robot = "mbot";  ///< name of the robot
  /// Time from the exposure of an image to the timestamp of its tags, which are stamped when published.
  Duration tag_latency = std::chrono::milliseconds(65);
};

/// Converts the messages from an MBot to the lines of a robot process (docs/formats/robot-process.md), using
/// the same decoders and conventions as for its logs. Publishers use different conventions without declaring
/// them, so the first messages are held back until the conventions are determined, usually for at most a
/// second. A message without a timestamp (utime 0) is given the robot's time at its arrival. Messages are
/// dropped, counted and reported if they cannot be decoded or have an unknown fingerprint or a misleading
/// timestamp. Pure: time is read from the messages.
class MbotBridge {
 public:
  explicit MbotBridge(const MbotBridgeOptions& options = {});
  MbotBridge(const MbotBridge&) = delete;
  MbotBridge& operator=(const MbotBridge&) = delete;

  /// The lines for a message, and for earlier messages that were held back.
  [[nodiscard]] std::vector<std::string> receive(LcmMessage message);
  /// The reports for the user since the last call, as log lines.
  [[nodiscard]] std::vector<std::string> take_reports();
  /// Number of dropped messages.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  /// Whether odometry has been received.
  [[nodiscard]] bool speaks() const { return gate_.offset().has_value(); }

 private:
  struct Stamped {
    Sample sample;
    Duration arrived{};
  };
  void survey(const LcmMessage& message);
  [[nodiscard]] bool is_determined(const LcmMessage& message) const;
  void hold(LcmMessage message);
  void release();
  void take(const LcmMessage& message);
  void take_truth(const LcmMessage& message);
  void write(const Stamped& stamped);
  void compare_clock(const LcmMessage& message);
  void note_problems();
  void drop(const std::string& channel, const std::string& why);

  MbotBridgeOptions options_;
  mbot::Survey survey_{};
  mbot::Conventions conventions_{};
  bool imu_determined_ = false;
  bool tags_determined_ = false;
  bool listening_ = true;  ///< whether all messages are being held back
  std::optional<Duration> first_{};
  std::deque<LcmMessage> held_{};
  Duration arrived_{};  ///< arrival time of the message being decoded
  ArrivalClock clock_{};
  LogProblems problems_{};
  std::map<std::string, std::uint64_t> reported_{};
  MessageLog::SampleVisitor visitor_;
  mbot::Samples samples_;
  std::vector<Stamped> early_{};  ///< samples received before the first odometry
  StampGate gate_{};
  RobotMessageReader check_{"LCM"};  ///< rejects lines that the reader in the other process would reject
  std::int64_t checked_ = 0;
  std::vector<std::string> lines_{};
  DropReports drops_{};
  std::uint64_t dropped_ = 0;
  std::set<std::string> compared_{};  ///< channels whose clock has been reported
  std::vector<std::string> pending_{};
};

}  // namespace waymark
