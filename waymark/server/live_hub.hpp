#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/recording/byte_io.hpp"
#include "waymark/server/access.hpp"
#include "waymark/server/health.hpp"
#include "waymark/server/live_channels.hpp"
#include "waymark/server/live_protocol.hpp"

namespace waymark {

/// One frame for a viewer. The body is shared between viewers; the head is not.
struct OutFrame {
  bool text = false;
  std::string head{};                        ///< an entire text frame, or the first bytes of a binary frame
  std::shared_ptr<const Bytes> body{};       ///< the rest of the frame, if any
  std::optional<std::uint32_t> newest_of{};  ///< replaces a waiting frame that has the same mark
  bool must_arrive = false;  ///< whether it must not be dropped, because the viewer cannot interpret later
                             ///< frames without it

  [[nodiscard]] std::size_t size() const { return head.size() + (body ? body->size() : 0); }
};

/// The queue for one viewer, limited in the number of frames and in bytes. If a viewer cannot keep up, the
/// oldest frames that may be dropped are dropped and counted.
class Outbox {
 public:
  static constexpr std::size_t kMaxFrames = 256;
  static constexpr std::size_t kMaxBytes = std::size_t{4} << 20U;

  /// Returns false if not even the frames that must arrive fit, in which case the viewer has stopped reading
  /// and should be disconnected.
  [[nodiscard]] bool put(OutFrame frame);
  [[nodiscard]] std::optional<OutFrame> next();
  [[nodiscard]] bool empty() const { return frames_.empty(); }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  [[nodiscard]] bool too_much() const { return frames_.size() > kMaxFrames || bytes_ > kMaxBytes; }

  std::deque<OutFrame> frames_;
  std::size_t bytes_ = 0;
  std::uint64_t dropped_ = 0;
};

/// WebSocket subprotocols that are supported: the page's own, and two names for the Foxglove protocol with
/// identical messages.
inline constexpr std::string_view kPageProtocol = "waymark.v1";
inline constexpr std::string_view kFoxgloveProtocols[] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};

/// The first supported subprotocol in an offer such as "a, b"; empty if none is supported.
[[nodiscard]] std::string_view choose_protocol(std::string_view offered);

/// All viewers of a running robot. Decides what each viewer receives and which one may send commands. Every
/// viewer may stop the robot, but only the one in control can move it. Uses neither sockets nor clocks;
/// single-threaded.
class LiveHub {
 public:
  using Id = std::uint32_t;
  static constexpr std::size_t kMaxClients = 16;
  /// Maximum number of viewers that do not have the token.
  static constexpr std::size_t kMaxWatchers = 12;

  /// `name` is the robot name shown to viewers.
  LiveHub(LiveFeed& feed, std::string name) : feed_(feed), name_(std::move(name)) {}

  /// Adds a viewer; returns `nullopt` if the limit is reached. `may_command` is true if it has the token.
  [[nodiscard]] std::optional<Id> join(std::string_view protocol, bool may_command, Duration now);
  /// Removes a viewer. If it was in control, the robot is stopped or the replay is paused.
  void leave(Id id);
  void receive_text(Id id, std::string_view text, Duration now);
  void receive_binary(Id id, std::span<const std::uint8_t> bytes, Duration now);
  /// Forwards the robot's data since the last call. `now` is the time on the host clock, as in the feed.
  void tick(Duration now);

  /// The next frame for this viewer.
  [[nodiscard]] std::optional<OutFrame> next(Id id);
  [[nodiscard]] bool waits(Id id) const;
  /// Whether the viewer has stopped reading and should be disconnected.
  [[nodiscard]] bool lost(Id id) const;
  [[nodiscard]] std::size_t clients() const { return clients_.size(); }
  [[nodiscard]] std::optional<Id> holder() const { return holder_; }

 private:
  struct Client {
    bool page = false;
    bool may_command = false;
    Outbox outbox{};
    std::map<std::uint32_t, std::uint32_t> channel_of{};  ///< channels by subscription
    std::size_t advertised = 0;                           ///< number of channels announced to the viewer
    std::map<std::uint32_t, std::string> publishes{};     ///< topics on which the viewer publishes, by
                                                          ///< channel
    std::uint64_t texts_version = 0;
    std::string last_control{};
    Duration received{};
    bool lost = false;
  };

  void put(Client& client, OutFrame frame);
  void put_text(Client& client, std::string text, std::optional<std::uint32_t> newest_of = {});
  void send(Client& client, const LiveMessage& message);
  void advertise(Client& client);
  void warn(Client& client, const std::string& words);
  void send_state(Duration now);
  void send_control(Id id, Client& client);
  void send_texts(Client& client);
  void pass_order(Id id, Client& client, const ViewerOrder& order);
  /// Gives control to the client if it is free. Returns whether the client is now in control.
  bool take(Id id, Client& client);
  void release(Id id, bool lost);
  void subscribe(Client& client, const ClientSubscribe& message);
  void advertise_own(Client& client, const ClientAdvertise& message);
  [[nodiscard]] std::set<std::uint32_t> wanted() const;

  LiveFeed& feed_;
  std::string name_;
  LiveChannels channels_{};
  RobotHealth health_{};
  LiveStatus status_{};
  std::shared_ptr<const LiveTexts> texts_ = std::make_shared<const LiveTexts>();
  std::map<Id, Client> clients_{};
  Id next_id_ = 1;
  std::optional<Id> holder_{};
  std::string last_phase_{};
  std::optional<Duration> state_told_{};
  bool camera_told_ = false;
  std::shared_ptr<const ros2::MarkerArray> shapes_{};
};

}  // namespace waymark
