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
  std::uint16_t port = 8642;          ///< where that one is taken, or is 0, any that is free
  std::string address = "127.0.0.1";  ///< other than loopback needs a token
  std::string token = {};             ///< empty: nobody commands
  std::vector<OfferedFile> offered{};
  LiveFeed* feed = nullptr;  ///< of a robot that runs; outlives the server
  std::string robot_name = {};
};

/// HTTP and, for a robot that runs, WebSockets, on one port. Everything runs in the thread that calls run();
/// at most 64 connections are held, web sockets included, fewer where this process may open few files
/// (`Seats` says who goes for whom); a request is at most 8 KiB; a first one that is not complete after 5 s,
/// or anything else that takes longer than 30 s, is dropped.
class HttpServer {
 public:
  /// Errors: no port at all, an address that is none of this machine or lacks its token, or the program was
  /// built without Boost.Beast.
  static Result<HttpServer> listen(ServerOptions options);

  HttpServer(HttpServer&&) noexcept;
  HttpServer& operator=(HttpServer&&) noexcept;
  ~HttpServer();

  [[nodiscard]] std::uint16_t port() const;
  /// Where a browser on this machine finds the page, with the token if there is one.
  [[nodiscard]] std::string url() const;
  /// The same for other machines, where it listens on all networks of this one; else nothing.
  [[nodiscard]] std::vector<std::string> urls_from_elsewhere() const;
  /// Answers until `stop` says so; it is asked ten times a second.
  void run(const std::function<bool()>& stop);

 private:
  struct Inside;
  explicit HttpServer(std::unique_ptr<Inside> inside);
  std::unique_ptr<Inside> inside_;
};

}  // namespace waymark
