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
#include "waymark/robots/process/drop_words.hpp"
#include "waymark/robots/process/robot_clock.hpp"
#include "waymark/robots/process/robot_messages.hpp"

namespace waymark {

struct MbotBridgeOptions {
  std::string robot = "mbot";  ///< its name
  /// How long before its stamp a picture was taken: tags are stamped when they are published.
  Duration tag_latency = std::chrono::milliseconds(65);
};

/// Turns the messages of an MBot into the lines of a robot process (docs/formats/robot-process.md), with the
/// decoders and conventions of its logs. Publishers differ in their conventions and say nothing: the first
/// messages are held back until they tell, a second at most where all come. A message without a stamp (utime
/// 0) counts as sent when it came, by the robot's clock. What cannot be decoded, has an unknown fingerprint
/// or a stamp that misleads is dropped, counted, and named in words. Pure: time comes with the messages.
class MbotBridge {
 public:
  explicit MbotBridge(const MbotBridgeOptions& options = {});
  MbotBridge(const MbotBridge&) = delete;
  MbotBridge& operator=(const MbotBridge&) = delete;

  /// The lines of a message, and of those that waited for it.
  [[nodiscard]] std::vector<std::string> receive(LcmMessage message);
  /// What people should know, since the last call: as lines, too.
  [[nodiscard]] std::vector<std::string> take_words();
  /// Messages that were dropped.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  /// Whether odometry came.
  [[nodiscard]] bool speaks() const { return gate_.offset().has_value(); }

 private:
  struct Stamped {
    Sample sample;
    Duration arrived{};
  };
  void survey(const LcmMessage& message);
  [[nodiscard]] bool told(const LcmMessage& message) const;
  void hold(LcmMessage message);
  void release();
  void take(const LcmMessage& message);
  void take_truth(const LcmMessage& message);
  void write(const Stamped& stamped);
  void compare_clock(const LcmMessage& message);
  void note_problems();
  void drop(const std::string& channel, const std::string& why);
  void report_once(const std::string& words);

  MbotBridgeOptions options_;
  mbot::Survey survey_{};
  mbot::Conventions conventions_{};
  bool imu_told_ = false;
  bool tags_told_ = false;
  bool listening_ = true;  ///< nothing passes yet
  std::optional<Duration> first_{};
  std::deque<LcmMessage> held_{};
  Duration arrived_{};  ///< of the message that is decoded
  ArrivalClock clock_{};
  LogProblems problems_{};
  std::map<std::string, std::uint64_t> reported_{};
  MessageLog::SampleVisitor visitor_;
  mbot::Samples samples_;
  std::vector<Stamped> early_{};  ///< before the first odometry
  StampGate gate_{};
  RobotMessageReader check_{"LCM"};  ///< nothing leaves that the other end would refuse
  std::int64_t checked_ = 0;
  std::vector<std::string> lines_{};
  DropReports drops_{};
  std::uint64_t dropped_ = 0;
  std::set<std::string> said_{};
  std::vector<std::string> words_{};
};

}  // namespace waymark
