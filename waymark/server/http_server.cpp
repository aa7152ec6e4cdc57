#include "waymark/server/http_server.hpp"

#ifdef WAYMARK_HAVE_BEAST
#include <chrono>
#include <utility>

#include <fmt/format.h>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/error.hpp>

#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include "waymark/server/background_thread.hpp"
#include "waymark/server/http_connection.hpp"
#include "waymark/server/own_addresses.hpp"

namespace waymark {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using asio::ip::tcp;

/// Descriptors that are left to the recording, the robot's pipes and whatever else this process opens.
constexpr std::uint64_t kKeptDescriptors = 64;
/// Where a connection cannot be taken now, the next attempt waits: the one that failed stays in the queue of
/// the system, and would be reported again at once.
constexpr std::chrono::milliseconds kBreath{100};

std::size_t allowed_connections() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return Seats::kMost;
  return seats_for(limit.rlim_cur, kKeptDescriptors);
}

}  // namespace

struct HttpServer::Inside {
  asio::io_context context{1};
  std::shared_ptr<SharedByConnections> shared = std::make_shared<SharedByConnections>();
  tcp::acceptor acceptor{context};
  asio::steady_timer timer{context};
  asio::steady_timer breath{context};
  /// Rung by the loop of the robot; writing to it never waits.
  asio::posix::stream_descriptor bell{context};
  std::uint64_t rings = 0;
  LiveFeed* feed = nullptr;
  BackgroundThread background{};
  asio::ip::address address = asio::ip::address_v4::loopback();

  Inside() = default;
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
  ~Inside() {
    if (feed != nullptr) feed->set_wake([] {});
    shared->live.reset();  // its sockets, which the context still holds, must not look for it
  }

  /// The address as it stands in a URL, of one that a browser on this machine can open.
  [[nodiscard]] std::string host() const {
    const std::string text = address.to_string();
    if (address.is_v6()) return address.is_unspecified() ? "[::1]" : fmt::format("[{}]", text);
    return address.is_unspecified() ? "127.0.0.1" : text;
  }

  [[nodiscard]] std::string url_at(const std::string& host) const {
    const AccessPolicy& policy = shared->policy;
    return fmt::format("http://{}:{}/{}{}", host, policy.port,
                       policy.token.empty() ? "" : "?token=", policy.token);
  }

  beast::error_code bind(std::uint16_t port) {
    beast::error_code error;
    const tcp::endpoint here(address, port);
    acceptor.close(error);
    acceptor.open(here.protocol(), error);
    if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor.bind(here, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    return error;
  }

  Status watch_feed(LiveFeed& live, const std::string& robot_name) {
    const int handle = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (handle < 0) return fail(ErrorCode::LimitExceeded, "no more files can be opened");
    bell.assign(handle);
    feed = &live;
    feed->set_wake([handle, this] {
      background.robot_is_here();
      const std::uint64_t one = 1;
      static_cast<void>(::write(handle, &one, sizeof one) == sizeof one);
    });
    shared->live = std::make_unique<LiveSockets>(live, robot_name, [] {
      return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch());
    });
    return {};
  }

  void hear_bell() {
    bell.async_read_some(asio::buffer(&rings, sizeof rings), [this](beast::error_code error, std::size_t) {
      if (error) return;
      background.keep_off_the_robot();
      shared->live->tick();
      hear_bell();
    });
  }

  void accept() {
    acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (error) return accept_later();
      serve_connection(std::move(socket), shared);
      accept();
    });
  }

  void accept_later() {
    breath.expires_after(kBreath);
    breath.async_wait([this](beast::error_code error) {
      if (!error) accept();
    });
  }

  void watch(const std::function<bool()>& stop) {
    timer.expires_after(std::chrono::milliseconds(100));
    timer.async_wait([this, &stop](beast::error_code error) {
      if (error || stop()) return context.stop();
      if (shared->live) shared->live->tick();
      watch(stop);
    });
  }
};

Result<HttpServer> HttpServer::listen(ServerOptions options) {
  auto inside = std::make_unique<Inside>();
  beast::error_code error;
  inside->address = asio::ip::make_address(options.address, error);
  if (error)
    return fail(ErrorCode::InvalidArgument, fmt::format("'{}' is no address of the network", options.address),
                {.key = "--listen"}, "For example 0.0.0.0 for all networks of this machine.");
  const bool remote = !inside->address.is_loopback();
  if (remote && options.token.empty())
    return fail(ErrorCode::InvalidArgument, "a server that others reach needs a token", {.key = "--token"});
  error = inside->bind(options.port);
  if (error && options.port != 0) error = inside->bind(0);
  if (error)
    return fail(ErrorCode::Unwritable,
                fmt::format("cannot listen on {}: {}", options.address, error.message()), {},
                "Another program may hold every port, or the address is none of this machine.");
  inside->shared->offered = {.files = std::move(options.offered), .live = options.feed != nullptr};
  inside->shared->seats = Seats(allowed_connections());
  inside->shared->policy = {.port = inside->acceptor.local_endpoint().port(),
                            .remote = remote,
                            .token = std::move(options.token),
                            .address = inside->host()};
  if (options.feed != nullptr) {
    if (Status status = inside->watch_feed(*options.feed, options.robot_name); !status)
      return tl::unexpected(status.error());
  }
  return HttpServer(std::move(inside));
}

std::uint16_t HttpServer::port() const { return inside_->shared->policy.port; }

std::string HttpServer::url() const { return inside_->url_at(inside_->host()); }

std::vector<std::string> HttpServer::urls_from_elsewhere() const {
  if (!inside_->address.is_unspecified()) return {};
  std::vector<std::string> urls = own_addresses(inside_->address.is_v6());
  for (std::string& url : urls) url = inside_->url_at(url);
  return urls;
}

void HttpServer::run(const std::function<bool()>& stop) {
  inside_->accept();
  inside_->watch(stop);
  if (inside_->shared->live) {
    inside_->background.begin();
    inside_->hear_bell();
  }
  inside_->context.run();
}

#else  // without Boost.Beast

namespace waymark {

struct HttpServer::Inside {};
Result<HttpServer> HttpServer::listen(ServerOptions /*options*/) {
  return fail(ErrorCode::Unsupported, "this program was built without Boost.Beast", {},
              "Install libboost-dev and build again.");
}
std::uint16_t HttpServer::port() const { return 0; }
std::string HttpServer::url() const { return {}; }
std::vector<std::string> HttpServer::urls_from_elsewhere() const { return {}; }
void HttpServer::run(const std::function<bool()>& /*stop*/) {}

#endif

HttpServer::HttpServer(std::unique_ptr<Inside> inside) : inside_(std::move(inside)) {}
HttpServer::HttpServer(HttpServer&&) noexcept = default;
HttpServer& HttpServer::operator=(HttpServer&&) noexcept = default;
HttpServer::~HttpServer() = default;

}  // namespace waymark
