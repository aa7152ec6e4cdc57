#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "waymark/recording/cdr_channels.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/dds/discovery.hpp"

namespace waymark {

/// Fails if another program publishes a topic of these channels, because subscribers would receive both; the
/// error names the program. Topics that usually have many publishers (/tf, /diagnostics, ...) are not
/// checked. Velocity commands are checked only if `commands` is set, that is, if they are played.
[[nodiscard]] Status check_no_other_publisher(const std::vector<LogChannel>& channels, bool commands,
                                              const Bus& bus);

/// Whether a topic's last messages are kept for later subscriptions: /tf_static, camera_info, and topics that
/// were recorded as transient local ("/map", "/robot_description").
[[nodiscard]] bool is_kept_for_late_joiners(const LogChannel& channel);

/// Publishes the messages of a recording unchanged, with their own stamps; ROS 1 messages are converted to
/// ROS 2. Velocity commands are converted between Twist and TwistStamped if the recorded type has no
/// subscription but the other has. Topics for which is_kept_for_late_joiners() is true are offered transient
/// local.
class LogPublisher {
 public:
  /// `commands`: publish velocity commands, which move a robot that subscribes to them. `moves` is called
  /// with each topic of commands before the first command.
  explicit LogPublisher(
      Bus& bus, bool commands, std::function<void(const BusTopic&)> moves = [](const BusTopic&) {})
      : bus_(bus), commands_(commands), moves_(std::move(moves)) {}

  /// Publishes a message; messages of other systems than ROS are skipped. Fails if it cannot be sent.
  Status publish(const LogChannel& channel, const LogMessage& message);
  /// Publishes the earlier messages that a subscription at the beginning of the selection would have
  /// received: every message of /tf_static, and the newest of each other topic that is kept for late joiners.
  Status publish_kept(MessageLog& log, const LogSelection& selection);
  /// Publishes zero on every topic on which velocity commands were published.
  Status stop();
  [[nodiscard]] std::uint64_t published() const { return published_; }
  /// Topics of velocity commands that were not published.
  [[nodiscard]] const std::set<std::string>& left_out() const { return omitted_; }
  /// Skipped topics: not of ROS, or damaged.
  [[nodiscard]] const std::set<std::string>& skipped_topics() const { return skipped_; }
  /// The reports for the user since the last call: converted commands, mismatched subscriptions.
  [[nodiscard]] std::vector<std::string> take_reports();

 private:
  struct Publisher {
    std::size_t number = 0;
    std::string type{};
  };
  Result<Publisher> advertise(const LogChannel& recorded, bool moves);
  [[nodiscard]] std::string subscribed_command(const LogChannel& recorded) const;

  Bus& bus_;
  bool commands_;
  std::function<void(const BusTopic&)> moves_;
  CdrChannels channels_{[](LogProblem::Kind, const std::string&, const Error&) {}};
  std::map<std::string, Publisher> publishers_{};  ///< by topic
  std::vector<TopicUse> uses_{};
  std::set<std::string> reported_{};
  std::vector<std::string> pending_{};
  std::map<std::size_t, bool> moving_{};  ///< publishers of commands; whether of TwistStamped
  std::set<std::string> skipped_{};
  std::set<std::string> omitted_{};
  std::uint64_t published_ = 0;
};

}  // namespace waymark
