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

/// One frame for a viewer. The body is shared among viewers, the head is its own.
struct OutFrame {
  bool text = false;
  std::string head{};                        ///< all of a text; the first bytes of a binary frame
  std::shared_ptr<const Bytes> body{};       ///< the rest, if any
  std::optional<std::uint32_t> newest_of{};  ///< replaces what waits with the same mark
  bool must_arrive = false;                  ///< never dropped; without it the viewer makes no sense

  [[nodiscard]] std::size_t size() const { return head.size() + (body ? body->size() : 0); }
};

/// What waits for one viewer: bounded in number and bytes. A viewer that does not keep up loses the oldest of
/// what may be lost, and it is counted.
class Outbox {
 public:
  static constexpr std::size_t kMaxFrames = 256;
  static constexpr std::size_t kMaxBytes = std::size_t{4} << 20U;

  /// False when even what must arrive does not fit: the viewer has stopped reading and should be let go.
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

/// The subprotocols of a WebSocket that are understood: the page's own, and Foxglove's two, which are the
/// same on the wire.
inline constexpr std::string_view kPageProtocol = "waymark.v1";
inline constexpr std::string_view kFoxgloveProtocols[] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};

/// The first of the offered subprotocols ("a, b") that is understood; empty where none is.
[[nodiscard]] std::string_view choose_protocol(std::string_view offered);

/// All viewers of a running robot: what each of them gets, and which one may command. Every viewer may stop
/// the robot; only the one that holds control moves it. Without sockets and without clocks; one thread.
class LiveHub {
 public:
  using Id = std::uint32_t;
  static constexpr std::size_t kMaxClients = 16;
  /// So many of them may be without the token.
  static constexpr std::size_t kMaxWatchers = 12;

  /// `name`: of the robot, for people.
  LiveHub(LiveFeed& feed, std::string name) : feed_(feed), name_(std::move(name)) {}

  /// A viewer has come; nothing when there is no room. `may_command`: it has the token.
  [[nodiscard]] std::optional<Id> join(std::string_view protocol, bool may_command, Duration now);
  /// It has gone; if it held control, the robot is stopped or paused.
  void leave(Id id);
  void hear_text(Id id, std::string_view text, Duration now);
  void hear_binary(Id id, std::span<const std::uint8_t> bytes, Duration now);
  /// Passes on what the robot said since the last call. `now` is of the host's clock, as in the feed.
  void tick(Duration now);

  /// What goes out next to this viewer.
  [[nodiscard]] std::optional<OutFrame> next(Id id);
  [[nodiscard]] bool waits(Id id) const;
  /// It does not read: let it go.
  [[nodiscard]] bool lost(Id id) const;
  [[nodiscard]] std::size_t clients() const { return clients_.size(); }
  [[nodiscard]] std::optional<Id> holder() const { return holder_; }

 private:
  struct Client {
    bool page = false;
    bool may_command = false;
    Outbox outbox{};
    std::map<std::uint32_t, std::uint32_t> channel_of{};  ///< by subscription
    std::size_t advertised = 0;                           ///< so many channels it knows
    std::map<std::uint32_t, std::string> publishes{};     ///< its own channels: topics
    std::uint64_t texts_version = 0;
    std::string last_control{};
    Duration received{};
    bool lost = false;
  };

  void put(Client& client, OutFrame frame);
  void put_text(Client& client, std::string text, std::optional<std::uint32_t> newest_of = {});
  void send(Client& client, const LiveMessage& message);
  void advertise(Client& client);
  void complain(Client& client, const std::string& words);
  void tell_state(Duration now);
  void tell_control(Id id, Client& client);
  void tell_texts(Client& client);
  void obey(Id id, Client& client, const ViewerOrder& order);
  /// Whether it holds control now; takes it where it is free.
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
