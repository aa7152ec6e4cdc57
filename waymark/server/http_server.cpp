#include "waymark/server/http_server.hpp"

#ifdef WAYMARK_HAVE_BEAST
#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

#include <sched.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "waymark/server/live_socket.hpp"

namespace waymark {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using asio::ip::tcp;

constexpr std::size_t kMostConnections = 64;
constexpr std::uint32_t kMostHeaderBytes = 8192;
constexpr std::chrono::seconds kPatience{30};
constexpr std::size_t kPieceBytes = std::size_t{256} * 1024;

std::string_view field(const http::request<http::empty_body>& request, http::field name) {
  const auto value = request[name];
  return {value.data(), value.size()};
}

/// This thread waits for the processor when the loop of the robot wants it, and does not interrupt it when a
/// sample wakes it. Best effort: a system that refuses serves viewers all the same.
void give_way_to_the_robot() {
  constexpr int kNice = 10;
  const sched_param none{};
  static_cast<void>(sched_setscheduler(0, SCHED_BATCH, &none));
  static_cast<void>(setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kNice));
}

/// What all connections share; outlives them.
struct Shared {
  OfferedThings offered{};
  AccessPolicy policy{};
  std::unique_ptr<LiveSockets> live{};
  std::size_t open = 0;  ///< connections
};

/// One connection: requests are read and answered in turn. A file goes out piece by piece, the next one when
/// the client has taken the last, so that a slow client costs one piece of memory.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, std::shared_ptr<Shared> shared)
      : stream_(std::move(socket)), shared_(std::move(shared)) {
    ++shared_->open;
    beast::error_code ignored;
    stream_.socket().set_option(tcp::no_delay(true), ignored);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() { --shared_->open; }

  void read() {
    parser_.emplace();
    parser_->header_limit(kMostHeaderBytes);
    parser_->body_limit(0);
    stream_.expires_after(kPatience);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](beast::error_code error, std::size_t) {
                       if (!error) self->answer();
                       // what is no request, or too long, ends the connection
                     });
  }

 private:
  void answer() {
    const auto& request = parser_->get();
    if (shared_->live && beast::websocket::is_upgrade(request) && upgrade(request)) return;
    const auto method = request.method_string();
    const auto target = request.target();
    reply_ = reply_to(
        {.method = {method.data(), method.size()},
         .target = {target.data(), target.size()},
         .host = field(request, http::field::host),
         .origin = field(request, http::field::origin),
         .cookie = field(request, http::field::cookie),
         .range = field(request, http::field::range),
         .accepts_gzip = field(request, http::field::accept_encoding).find("gzip") != std::string_view::npos},
        shared_->offered, shared_->policy);
    head_ = {};
    head_.result(static_cast<unsigned>(reply_.status));
    head_.version(request.version());
    for (const auto& [name, value] : reply_.headers) head_.set(name, value);
    head_.content_length(reply_.length());
    keep_alive_ = request.keep_alive();
    head_.keep_alive(keep_alive_);
    body_wanted_ = request.method() != http::verb::head;
    writer_.emplace(head_);
    stream_.expires_after(kPatience);
    http::async_write_header(stream_, *writer_,
                             [self = shared_from_this()](beast::error_code error, std::size_t) {
                               if (!error) self->write_body();
                             });
  }

  /// False: it is not let in, and gets an answer like any other request.
  bool upgrade(const http::request<http::empty_body>& request) {
    const auto target = request.target();
    const AccessRights rights = rights_of({.host = field(request, http::field::host),
                                           .origin = field(request, http::field::origin),
                                           .target = {target.data(), target.size()},
                                           .cookie = field(request, http::field::cookie)},
                                          shared_->policy);
    if (rights.refusal != AccessRights::Refusal::None) return false;
    shared_->live->accept(std::move(stream_), request, rights.token);
    return true;
  }

  void write_body() {
    if (!body_wanted_ || reply_.length() == 0) return next();
    if (const auto* part = std::get_if<FilePart>(&reply_.body)) {
      file_ = std::ifstream(part->path, std::ios::binary);
      file_.seekg(static_cast<std::streamoff>(part->first));
      left_ = part->length;
      return write_piece();
    }
    const auto* text = std::get_if<std::string>(&reply_.body);
    const std::string_view view = text != nullptr ? *text : std::get<std::string_view>(reply_.body);
    asio::async_write(stream_, asio::buffer(view.data(), view.size()),
                      [self = shared_from_this()](beast::error_code error, std::size_t) {
                        if (!error) self->next();
                      });
  }

  void write_piece() {
    if (left_ == 0) return next();
    piece_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left_, kPieceBytes)));
    file_.read(piece_.data(), static_cast<std::streamsize>(piece_.size()));
    if (file_.gcount() != static_cast<std::streamsize>(piece_.size()))
      return;  // shorter than it was: hang up
    left_ -= piece_.size();
    stream_.expires_after(kPatience);
    asio::async_write(stream_, asio::buffer(piece_),
                      [self = shared_from_this()](beast::error_code error, std::size_t) {
                        if (!error) self->write_piece();
                      });
  }

  void next() {
    if (keep_alive_) return read();
    beast::error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  HttpReply reply_;
  http::response<http::empty_body> head_;
  std::optional<http::response_serializer<http::empty_body>> writer_;
  std::ifstream file_;
  std::vector<char> piece_;
  std::uint64_t left_ = 0;
  bool keep_alive_ = false;
  bool body_wanted_ = true;
  std::shared_ptr<Shared> shared_;
};

}  // namespace

struct HttpServer::Inside {
  asio::io_context context{1};
  std::shared_ptr<Shared> shared = std::make_shared<Shared>();
  tcp::acceptor acceptor{context};
  asio::steady_timer timer{context};
  /// Rung by the loop of the robot; writing to it never waits.
  asio::posix::stream_descriptor bell{context};
  std::uint64_t rings = 0;
  LiveFeed* feed = nullptr;
  asio::ip::address address = asio::ip::address_v4::loopback();

  Inside() = default;
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
  ~Inside() {
    if (feed != nullptr) feed->set_wake([] {});
    shared->live.reset();  // its sockets, which the context still holds, must not look for it
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
    feed->set_wake([handle] {
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
      shared->live->tick();
      hear_bell();
    });
  }

  void accept() {
    acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error && shared->open < kMostConnections)
        std::make_shared<Connection>(std::move(socket), shared)->read();
      accept();
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
  inside->shared->policy = {
      .port = inside->acceptor.local_endpoint().port(), .remote = remote, .token = std::move(options.token)};
  if (options.feed != nullptr) {
    if (Status status = inside->watch_feed(*options.feed, options.robot_name); !status)
      return tl::unexpected(status.error());
  }
  return HttpServer(std::move(inside));
}

std::uint16_t HttpServer::port() const { return inside_->shared->policy.port; }

std::string HttpServer::url() const {
  const AccessPolicy& policy = inside_->shared->policy;
  const bool all = inside_->address.is_unspecified() || inside_->address.is_loopback();
  const std::string host = all                        ? std::string("127.0.0.1")
                           : inside_->address.is_v6() ? fmt::format("[{}]", inside_->address.to_string())
                                                      : inside_->address.to_string();
  return fmt::format("http://{}:{}/{}{}", host, policy.port,
                     policy.token.empty() ? "" : "?token=", policy.token);
}

void HttpServer::run(const std::function<bool()>& stop) {
  inside_->accept();
  inside_->watch(stop);
  if (inside_->shared->live) {
    give_way_to_the_robot();
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
void HttpServer::run(const std::function<bool()>& /*stop*/) {}

#endif

HttpServer::HttpServer(std::unique_ptr<Inside> inside) : inside_(std::move(inside)) {}
HttpServer::HttpServer(HttpServer&&) noexcept = default;
HttpServer& HttpServer::operator=(HttpServer&&) noexcept = default;
HttpServer::~HttpServer() = default;

}  // namespace waymark
