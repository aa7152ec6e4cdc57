#pragma once

#ifdef WAYMARK_HAVE_BEAST
#include <functional>
#include <map>
#include <memory>

#include "waymark/server/access.hpp"
#include "waymark/server/live_socket.hpp"
#include "waymark/server/replies.hpp"
#include "waymark/server/seats.hpp"

#include <boost/asio/ip/tcp.hpp>

namespace waymark {

/// What all connections of a server share; outlives them.
struct SharedByConnections {
  OfferedThings offered{};
  AccessPolicy policy{};
  std::unique_ptr<LiveSockets> live{};
  Seats seats{};
  std::map<Seats::Id, std::function<void()>> hang_up{};  ///< on the connection that has this seat

  void drop(Seats::Id id) {
    if (const auto found = hang_up.find(id); found != hang_up.end()) std::function<void()>(found->second)();
  }
};

/// Reads requests of one client and answers them in turn, until one of the two hangs up. Closed at once when
/// there is no seat for it.
void serve_connection(boost::asio::ip::tcp::socket socket, std::shared_ptr<SharedByConnections> shared);

}  // namespace waymark
#endif
