#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/server/replies.hpp"

namespace waymark {

/// HTTP on 127.0.0.1, read-only. Everything runs in the thread that calls run(); at most 64 connections are
/// held, a request is at most 8 KiB, and one that takes longer than 30 s is dropped.
class HttpServer {
 public:
  /// Listens on `port`; where that one is taken, or is 0, on any that is free. Errors: no port at all, or the
  /// program was built without Boost.Beast.
  static Result<HttpServer> listen(std::uint16_t port, std::vector<OfferedFile> offered);

  HttpServer(HttpServer&&) noexcept;
  HttpServer& operator=(HttpServer&&) noexcept;
  ~HttpServer();

  [[nodiscard]] std::uint16_t port() const;
  /// Answers until `stop` says so; it is asked ten times a second.
  void run(const std::function<bool()>& stop);

 private:
  struct Inside;
  explicit HttpServer(std::unique_ptr<Inside> inside);
  std::unique_ptr<Inside> inside_;
};

}  // namespace waymark
