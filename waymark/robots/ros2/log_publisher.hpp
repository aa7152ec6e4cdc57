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
/// error contains the name of that program. Topics that usually have many publishers (/tf, /diagnostics, ...)
/// are not checked. Velocity commands are checked only if `commands` is set, that is, if they are played.
[[nodiscard]] Status check_no_other_publisher(const std::vector<LogChannel>& channels, bool commands,
                                              const Bus& bus);

/// Whether the last messages on a topic are kept for later subscriptions: /tf_static, camera_info, and topics
/// that were recorded as transient local ("/map", "/robot_description").
[[nodiscard]] bool is_kept_for_late_joiners(const LogChannel& channel);

/// Publishes the messages in a recording unchanged, with their own timestamps; ROS 1 messages are converted
/// to ROS 2. Velocity commands are converted between Twist and TwistStamped if only the other type has a
/// subscription. Topics for which is_kept_for_late_joiners() is true are offered as transient local.
class LogPublisher {
 public:
  /// `commands`: whether to publish velocity commands, which move any robot that subscribes to them. `moves`
  /// is called with each command topic before its first command.
  explicit LogPublisher(
      Bus& bus, bool commands, std::function<void(const BusTopic&)> moves = [](const BusTopic&) {})
      : bus_(bus), commands_(commands), moves_(std::move(moves)) {}

  /// Publishes a message; messages that do not come from ROS are skipped. Fails if it cannot be sent.
  Status publish(const LogChannel& channel, const LogMessage& message);
  /// Publishes the earlier messages that a subscription at the beginning of the selection would have
  /// received: every message on /tf_static, and the newest one on every other topic that is kept for late
  /// joiners.
  Status publish_kept(MessageLog& log, const LogSelection& selection);
  /// Publishes zero on every topic on which velocity commands have been published.
  Status stop();
  [[nodiscard]] std::uint64_t published() const { return published_; }
  /// Topics with velocity commands that were not published.
  [[nodiscard]] const std::set<std::string>& left_out() const { return omitted_; }
  /// Skipped topics, which are not from ROS or are damaged.
  [[nodiscard]] const std::set<std::string>& skipped_topics() const { return skipped_; }
  /// The reports for the user since the last call, about converted commands and mismatched subscriptions.
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
  std::map<std::size_t, bool> moving_{};  ///< publishers of commands, and whether they use TwistStamped
  std::set<std::string> skipped_{};
  std::set<std::string> omitted_{};
  std::uint64_t published_ = 0;
};

}  // namespace waymark
