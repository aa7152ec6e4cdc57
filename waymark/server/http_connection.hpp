#pragma once

#ifdef WAYMARK_HAVE_BEAST
#include <cstddef>
#include <memory>

#include "waymark/server/access.hpp"
#include "waymark/server/live_socket.hpp"
#include "waymark/server/replies.hpp"

#include <boost/asio/ip/tcp.hpp>

namespace waymark {

/// What all connections of a server share; outlives them.
struct SharedByConnections {
  OfferedThings offered{};
  AccessPolicy policy{};
  std::unique_ptr<LiveSockets> live{};
  std::size_t open = 0;  ///< connections
};

/// Reads requests of one client and answers them in turn, until one of the two hangs up.
void serve_connection(boost::asio::ip::tcp::socket socket, std::shared_ptr<SharedByConnections> shared);

}  // namespace waymark
#endif
