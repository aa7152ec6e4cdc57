#pragma once

#ifdef WAYMARK_HAVE_BEAST
#include <functional>
#include <map>
#include <memory>

#include "waymark/server/live_hub.hpp"

#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>

/// The WebSockets of the viewers of a running robot (RFC 6455, by Boost.Beast). One thread.
namespace waymark {

class LiveSocket;

/// All sockets and the hub they talk to.
class LiveSockets {
 public:
  /// `now`: the host's clock, as in the feed.
  LiveSockets(LiveFeed& feed, std::string robot_name, std::function<Duration()> now);
  ~LiveSockets();
  LiveSockets(const LiveSockets&) = delete;
  LiveSockets& operator=(const LiveSockets&) = delete;

  /// Answers an upgrade that has been let in, and holds its seat while it is connected. What it returns hangs
  /// up on it.
  std::function<void()> accept(boost::beast::tcp_stream stream,
                               const boost::beast::http::request<boost::beast::http::empty_body>& request,
                               bool may_command, std::shared_ptr<void> seat);
  /// Passes on what the robot said.
  void tick();

 private:
  friend class LiveSocket;
  void flush();

  LiveHub hub_;
  std::function<Duration()> now_;
  std::map<LiveHub::Id, std::weak_ptr<LiveSocket>> sockets_{};
};

}  // namespace waymark
#endif
