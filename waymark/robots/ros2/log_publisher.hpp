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

/// Fails where another program of the network publishes one of these channels' topics, which all would take
/// for one robot; names it. Topics that many publish (/tf, /diagnostics, ...) are no matter; velocity
/// commands only where `commands` says that they are played.
[[nodiscard]] Status nobody_publishes(const std::vector<LogChannel>& channels, bool commands, const Bus& bus);

/// Whether a topic's last messages are kept for subscriptions that come later: /tf_static, camera_info, and
/// what the recording says was offered transient local ("/map", "/robot_description").
[[nodiscard]] bool is_kept_for_late_joiners(const LogChannel& channel);

/// Publishes the messages of a recording as they lie in it, with their own stamps; those of ROS 1 as ROS 2
/// writes them. Velocity commands are published as Twist or TwistStamped, whichever is subscribed where the
/// recorded one is not. What is_kept_for_late_joiners() is offered transient local.
class LogPublisher {
 public:
  /// Velocity commands move a robot that listens to them: they are published where `commands` says so.
  /// `moves` is told of each topic of commands before the first of them.
  explicit LogPublisher(
      Bus& bus, bool commands, std::function<void(const BusTopic&)> moves = [](const BusTopic&) {})
      : bus_(bus), commands_(commands), moves_(std::move(moves)) {}

  /// A message that is not of ROS is passed over. Fails where the network refuses it.
  Status publish(const LogChannel& channel, const LogMessage& message);
  /// What a subscription that came at the beginning of the selection would have been given of earlier times:
  /// every message of /tf_static, the newest of the other topics that are kept for late joiners.
  Status publish_kept(MessageLog& log, const LogSelection& selection);
  /// Zero on every topic on which velocity commands were published.
  Status stop();
  [[nodiscard]] std::uint64_t published() const { return published_; }
  /// Topics of velocity commands that were left out.
  [[nodiscard]] const std::set<std::string>& left_out() const { return left_out_; }
  /// Topics that were passed over: not of ROS, or damaged.
  [[nodiscard]] const std::set<std::string>& passed_over() const { return passed_over_; }
  /// What people should know since the last call: commands of another type than recorded, subscriptions that
  /// get nothing.
  [[nodiscard]] std::vector<std::string> take_words();

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
  std::set<std::string> said_{};
  std::vector<std::string> words_{};
  std::map<std::size_t, bool> moving_{};  ///< publishers of commands; whether of TwistStamped
  std::set<std::string> passed_over_{};
  std::set<std::string> left_out_{};
  std::uint64_t published_ = 0;
};

}  // namespace waymark
