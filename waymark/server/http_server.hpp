#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/server/live_feed.hpp"
#include "waymark/server/replies.hpp"

namespace waymark {

struct ServerOptions {
  std::uint16_t port = 8642;          ///< any free port if this one is in use, or if 0
  std::string address = "127.0.0.1";  ///< any address other than loopback requires a token
  std::string token = {};             ///< if empty, no viewer may send commands
  std::vector<OfferedFile> offered{};
  LiveFeed* feed = nullptr;  ///< feed of a running robot; must outlive the server
  std::string robot_name = {};
};

/// An HTTP server on one port, with WebSockets for a running robot. Everything runs on the thread that calls
/// run(). Accepts up to 64 connections including WebSockets, or fewer if this process may only open a few
/// files (`Seats` decides which connections are dropped). A request may have up to 8 KiB. A connection is
/// dropped if its first request is incomplete after 5 s, or if any other operation takes longer than 30 s.
class HttpServer {
 public:
  /// Fails if no port is free, if the address does not belong to this machine or requires a token, or if the
  /// program was built without Boost.Beast.
  static Result<HttpServer> listen(ServerOptions options);

  HttpServer(HttpServer&&) noexcept;
  HttpServer& operator=(HttpServer&&) noexcept;
  ~HttpServer();

  [[nodiscard]] std::uint16_t port() const;
  /// The URL of the page for a browser on this machine, including the token if one is set.
  [[nodiscard]] std::string url() const;
  /// URLs for other machines if the server listens on all networks; otherwise empty.
  [[nodiscard]] std::vector<std::string> urls_from_elsewhere() const;
  /// Serves until `stop`, which is called ten times per second, returns true.
  void run(const std::function<bool()>& stop);

 private:
  struct Inside;
  explicit HttpServer(std::unique_ptr<Inside> inside);
  std::unique_ptr<Inside> inside_;
};

}  // namespace waymark
