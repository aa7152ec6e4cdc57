#include "waymark/server/http_server.hpp"

#ifdef WAYMARK_HAVE_BEAST
#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fmt/format.h>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/field.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket.hpp>

#include "waymark/server/access.hpp"
#include "waymark/server/background_thread.hpp"
#include "waymark/server/live_hub.hpp"
#include "waymark/server/seats.hpp"

namespace waymark {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using asio::ip::tcp;

using Request = http::request<http::empty_body>;

constexpr std::size_t kMaxMessageBytes = 64 * 1024;
/// A viewer that does not respond to a ping within this time is disconnected (the network cable may have been
/// unplugged).
constexpr std::chrono::seconds kPingTimeout{4};

}  // namespace

// WebSockets for the viewers of a running robot (RFC 6455, using Boost.Beast). Single-threaded.

class LiveSocket;

/// All sockets and the hub that serves them.
class LiveSockets {
 public:
  /// `now` returns the time on the host clock, as in the feed.
  LiveSockets(LiveFeed& feed, std::string robot_name, std::function<Duration()> now);
  ~LiveSockets();
  LiveSockets(const LiveSockets&) = delete;
  LiveSockets& operator=(const LiveSockets&) = delete;

  /// Accepts an authorised upgrade, which keeps its seat while it is connected. Returns a function that
  /// closes the connection.
  std::function<void()> accept(boost::beast::tcp_stream stream,
                               const boost::beast::http::request<boost::beast::http::empty_body>& request,
                               bool may_command, std::shared_ptr<void> seat);
  /// Forwards new data from the robot.
  void tick();

 private:
  friend class LiveSocket;
  void flush();

  LiveHub hub_;
  std::function<Duration()> now_;
  std::map<LiveHub::Id, std::weak_ptr<LiveSocket>> sockets_{};
};

/// A single viewer. Reads one frame at a time and, concurrently, writes one frame at a time.
class LiveSocket : public std::enable_shared_from_this<LiveSocket> {
 public:
  LiveSocket(beast::tcp_stream stream, LiveSockets& all, std::shared_ptr<void> seat)
      : stream_(std::move(stream)), all_(&all), seat_(std::move(seat)) {}
  LiveSocket(const LiveSocket&) = delete;
  LiveSocket& operator=(const LiveSocket&) = delete;
  ~LiveSocket() = default;

  void accept(Request request, bool may_command) {
    const auto offered = request[http::field::sec_websocket_protocol];
    const std::string protocol(choose_protocol({offered.data(), offered.size()}));
    beast::get_lowest_layer(stream_).expires_never();
    stream_.set_option(websocket::stream_base::timeout{std::chrono::seconds(5), kPingTimeout, true});
    stream_.set_option(websocket::stream_base::decorator([protocol](websocket::response_type& answer) {
      if (!protocol.empty()) answer.set(http::field::sec_websocket_protocol, protocol);
    }));
    stream_.read_message_max(kMaxMessageBytes);
    stream_.auto_fragment(false);  // an image is sent as one frame, so that no other frame can interrupt it
    request_ = std::move(request);
    stream_.async_accept(request_,
                         [self = shared_from_this(), protocol, may_command](beast::error_code error) {
                           if (!error) self->begin(protocol, may_command);
                         });
  }

  void write() {
    if (writing_ || gone_) return;
    if (all_->hub_.lost(id_)) return end();
    auto frame = all_->hub_.next(id_);
    if (!frame) return;
    frame_ = std::move(*frame);
    writing_ = true;
    stream_.text(frame_.text);
    const std::array<asio::const_buffer, 2> parts{
        asio::buffer(frame_.head), frame_.body ? asio::buffer(*frame_.body) : asio::const_buffer()};
    stream_.async_write(parts, [self = shared_from_this()](beast::error_code error, std::size_t) {
      self->writing_ = false;
      if (error) return self->end();
      self->write();
    });
  }

  /// Called when the server is being destroyed.
  void forget() { gone_ = true; }
  /// Closes the connection, so that pending operations end with an error.
  void hang_up() {
    beast::error_code ignored;
    beast::get_lowest_layer(stream_).socket().close(ignored);
  }

 private:
  void begin(const std::string& protocol, bool may_command) {
    const auto id = all_->hub_.join(protocol, may_command, all_->now_());
    if (!id) {  // no more viewers are admitted
      return stream_.async_close(websocket::close_code::try_again_later,
                                 [self = shared_from_this()](beast::error_code) {});
    }
    id_ = *id;
    all_->sockets_[id_] = weak_from_this();
    read();
    write();
  }

  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (self->gone_) return;
      if (error) return self->end();
      self->receive();
      self->read();
    });
  }

  void receive() {
    const auto data = buffer_.cdata();
    if (stream_.got_text())
      all_->hub_.receive_text(id_, {static_cast<const char*>(data.data()), data.size()}, all_->now_());
    else
      all_->hub_.receive_binary(id_, {static_cast<const std::uint8_t*>(data.data()), data.size()},
                                all_->now_());
    buffer_.consume(buffer_.size());
    all_->tick();
  }

  void end() {
    if (std::exchange(gone_, true)) return;
    all_->sockets_.erase(id_);
    all_->hub_.leave(id_);
    hang_up();
  }

  websocket::stream<beast::tcp_stream> stream_;
  LiveSockets* all_;
  std::shared_ptr<void> seat_;
  Request request_;
  beast::flat_buffer buffer_;
  LiveHub::Id id_ = 0;
  OutFrame frame_;  ///< the frame being sent
  bool writing_ = false;
  bool gone_ = false;
};

LiveSockets::LiveSockets(LiveFeed& feed, std::string robot_name, std::function<Duration()> now)
    : hub_(feed, std::move(robot_name)), now_(std::move(now)) {}

LiveSockets::~LiveSockets() {
  for (const auto& [id, weak] : sockets_) {
    if (const auto socket = weak.lock()) socket->forget();
  }
}

std::function<void()> LiveSockets::accept(beast::tcp_stream stream, const Request& request, bool may_command,
                                          std::shared_ptr<void> seat) {
  const auto socket = std::make_shared<LiveSocket>(std::move(stream), *this, std::move(seat));
  socket->accept(request, may_command);
  return [weak = std::weak_ptr(socket)] {
    if (const auto live = weak.lock()) live->hang_up();
  };
}

void LiveSockets::tick() {
  hub_.tick(now_());
  flush();
}

void LiveSockets::flush() {
  std::vector<std::shared_ptr<LiveSocket>> all;  // write() may remove an element
  for (const auto& [id, weak] : sockets_) {
    if (auto socket = weak.lock()) all.push_back(std::move(socket));
  }
  for (const auto& socket : all) socket->write();
}

/// State shared by all connections to a server, which outlives them.
struct SharedByConnections {
  OfferedThings offered{};
  AccessPolicy policy{};
  std::unique_ptr<LiveSockets> live{};
  Seats seats{};
  std::map<Seats::Id, std::function<void()>> hang_up{};  ///< functions that close the connection in each seat

  void drop(Seats::Id id) {
    if (const auto found = hang_up.find(id); found != hang_up.end()) std::function<void()>(found->second)();
  }
};

namespace {

constexpr std::uint32_t kMaxHeaderBytes = 8192;
constexpr std::chrono::seconds kTimeout{30};
// A well-behaved client sends the head of its first request in one piece.
constexpr std::chrono::seconds kHeadTimeout{5};
constexpr std::size_t kPieceBytes = std::size_t{256} * 1024;

std::string_view field(const http::request<http::empty_body>& request, http::field name) {
  const auto value = request[name];
  return {value.data(), value.size()};
}

/// A seat that is released when its connection ends, whether or not it is a WebSocket.
class HeldSeat {
 public:
  HeldSeat(std::shared_ptr<SharedByConnections> shared, Seats::Id id) : shared_(std::move(shared)), id_(id) {}
  HeldSeat(const HeldSeat&) = delete;
  HeldSeat& operator=(const HeldSeat&) = delete;
  ~HeldSeat() {
    shared_->hang_up.erase(id_);
    shared_->seats.leave(id_);
  }
  [[nodiscard]] Seats::Id id() const { return id_; }

 private:
  std::shared_ptr<SharedByConnections> shared_;
  Seats::Id id_;
};

/// A connection, whose requests are read and answered one by one. A file is sent block by block; the next
/// block is read after the client has received the previous one. A slow client therefore takes up only one
/// block of memory.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, std::shared_ptr<SharedByConnections> shared, Seats::Id seat)
      : stream_(std::move(socket)),
        shared_(std::move(shared)),
        seat_(std::make_shared<HeldSeat>(shared_, seat)) {
    beast::error_code ignored;
    stream_.socket().set_option(tcp::no_delay(true), ignored);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() = default;

  void begin() {
    shared_->hang_up[seat_->id()] = [weak = weak_from_this()] {
      if (const auto self = weak.lock()) self->stream_.close();
    };
    read(kHeadTimeout);
  }

 private:
  void read(std::chrono::seconds patience) {
    parser_.emplace();
    parser_->header_limit(kMaxHeaderBytes);
    parser_->body_limit(0);
    stream_.expires_after(patience);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](beast::error_code error, std::size_t) {
                       if (!error) self->answer();
                       // an invalid or overlong request ends the connection
                     });
  }

  [[nodiscard]] AccessRights rights(const http::request<http::empty_body>& request) const {
    const auto target = request.target();
    return rights_of({.host = field(request, http::field::host),
                      .origin = field(request, http::field::origin),
                      .target = {target.data(), target.size()},
                      .cookie = field(request, http::field::cookie)},
                     shared_->policy);
  }

  void answer() {
    const auto& request = parser_->get();
    const AccessRights may = rights(request);
    if (const auto dropped = shared_->seats.request_received(seat_->id(), may.token)) shared_->drop(*dropped);
    if (!stream_.socket().is_open()) return;
    if (shared_->live && beast::websocket::is_upgrade(request) && upgrade(request, may)) return;
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
    stream_.expires_after(kTimeout);
    http::async_write_header(stream_, *writer_,
                             [self = shared_from_this()](beast::error_code error, std::size_t) {
                               if (!error) self->write_body();
                             });
  }

  /// Returns false if the request is not authorised; it is then answered like any other request.
  bool upgrade(const http::request<http::empty_body>& request, const AccessRights& rights) {
    if (rights.refusal != AccessRights::Refusal::None) return false;
    shared_->hang_up[seat_->id()] = shared_->live->accept(std::move(stream_), request, rights.token, seat_);
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
      return;  // the file has become shorter, so close the connection
    left_ -= piece_.size();
    stream_.expires_after(kTimeout);
    asio::async_write(stream_, asio::buffer(piece_),
                      [self = shared_from_this()](beast::error_code error, std::size_t) {
                        if (!error) self->write_piece();
                      });
  }

  void next() {
    if (keep_alive_) return read(kTimeout);
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
  std::shared_ptr<SharedByConnections> shared_;
  std::shared_ptr<HeldSeat> seat_;
};

/// Reads requests from one client and answers them one by one until either side closes the connection. Closes
/// the connection immediately if no seat is free.
void serve_connection(tcp::socket socket, std::shared_ptr<SharedByConnections> shared) {
  const auto admission = shared->seats.admit();
  if (!admission) return;
  if (admission->dropped) shared->drop(*admission->dropped);
  std::make_shared<Connection>(std::move(socket), std::move(shared), admission->id)->begin();
}

/// Descriptors reserved for the recording, the pipes to the robot, and other files of this process.
constexpr std::uint64_t kKeptDescriptors = 64;
/// Delay after a failed accept(), because the connection remains in the system's queue and accept() would
/// fail again immediately.
constexpr std::chrono::milliseconds kAcceptRetryDelay{100};

std::size_t allowed_connections() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return Seats::kMaxSeats;
  return seats_for(limit.rlim_cur, kKeptDescriptors);
}

/// Addresses at which other machines can reach this one, as in a URL ("192.168.1.7", "[fd00::7]"). Excludes
/// loopback and link-local addresses.
std::vector<std::string> own_addresses(bool with_ipv6) {
  std::vector<std::string> all;
  ifaddrs* first = nullptr;
  if (::getifaddrs(&first) != 0) return all;
  for (const ifaddrs* at = first; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr) continue;
    std::array<char, INET6_ADDRSTRLEN> text{};
    if (at->ifa_addr->sa_family == AF_INET) {
      const auto* v4 = reinterpret_cast<const sockaddr_in*>(at->ifa_addr);
      constexpr std::uint32_t kLoopback = 127;
      if (ntohl(v4->sin_addr.s_addr) >> 24U == kLoopback) continue;
      if (::inet_ntop(AF_INET, &v4->sin_addr, text.data(), text.size()) != nullptr)
        all.emplace_back(text.data());
    } else if (with_ipv6 && at->ifa_addr->sa_family == AF_INET6) {
      const auto* v6 = reinterpret_cast<const sockaddr_in6*>(at->ifa_addr);
      if (IN6_IS_ADDR_LINKLOCAL(&v6->sin6_addr) || IN6_IS_ADDR_LOOPBACK(&v6->sin6_addr)) continue;
      if (::inet_ntop(AF_INET6, &v6->sin6_addr, text.data(), text.size()) != nullptr)
        all.push_back(fmt::format("[{}]", text.data()));
    }
  }
  ::freeifaddrs(first);
  return all;
}

}  // namespace

struct HttpServer::Inside {
  asio::io_context context{1};
  std::shared_ptr<SharedByConnections> shared = std::make_shared<SharedByConnections>();
  tcp::acceptor acceptor{context};
  asio::steady_timer timer{context};
  asio::steady_timer accept_retry{context};
  /// Signalled by the robot loop; writing to it never blocks.
  asio::posix::stream_descriptor feed_event{context};
  std::uint64_t feed_events = 0;
  LiveFeed* feed = nullptr;
  BackgroundThread background{};
  asio::ip::address address = asio::ip::address_v4::loopback();

  Inside() = default;
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
  ~Inside() {
    if (feed != nullptr) feed->set_wake([] {});
    shared->live.reset();  // sockets still held by the context must not use it any more
  }

  /// The address to use in a URL that a browser on this machine can open.
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
    if (handle < 0) return fail(ErrorCode::LimitExceeded, "cannot create an eventfd: too many open files");
    feed_event.assign(handle);
    feed = &live;
    feed->set_wake([handle, this] {
      background.note_robot_processor();
      const std::uint64_t one = 1;
      static_cast<void>(::write(handle, &one, sizeof one) == sizeof one);
    });
    shared->live = std::make_unique<LiveSockets>(live, robot_name, [] {
      return std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch());
    });
    return {};
  }

  void wait_for_feed() {
    feed_event.async_read_some(asio::buffer(&feed_events, sizeof feed_events),
                               [this](beast::error_code error, std::size_t) {
                                 if (error) return;
                                 background.avoid_robot_processor();
                                 shared->live->tick();
                                 wait_for_feed();
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
    accept_retry.expires_after(kAcceptRetryDelay);
    accept_retry.async_wait([this](beast::error_code error) {
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
    return fail(ErrorCode::InvalidArgument, fmt::format("'{}' is not a network address", options.address),
                {.key = "listen"}, "For example 0.0.0.0 for all networks of this machine.");
  const bool remote = !inside->address.is_loopback();
  if (remote && options.token.empty())
    return fail(ErrorCode::InvalidArgument, "a server that other machines can reach requires a token",
                {.key = "token"});
  error = inside->bind(options.port);
  if (error && options.port != 0) error = inside->bind(0);
  if (error)
    return fail(ErrorCode::Unwritable,
                fmt::format("cannot listen on {}: {}", options.address, error.message()), {},
                "Use an address of this machine (`ip address` lists them), or 0.0.0.0 for all its networks.");
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
    inside_->wait_for_feed();
  }
  inside_->context.run();
}

#else  // built without Boost.Beast

namespace waymark {

struct HttpServer::Inside {};
Result<HttpServer> HttpServer::listen(ServerOptions /*options*/) {
  return fail(ErrorCode::Unsupported, "built without Boost.Beast", {},
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
