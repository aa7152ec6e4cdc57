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
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>

namespace waymark {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using asio::ip::tcp;

constexpr std::size_t kMostConnections = 64;
constexpr std::uint32_t kMostHeaderBytes = 8192;
constexpr std::chrono::seconds kPatience{30};
constexpr std::size_t kPieceBytes = 256 * 1024;

std::string_view field(const http::request<http::empty_body>& request, http::field name) {
  const auto value = request[name];
  return {value.data(), value.size()};
}

/// One connection: requests are read and answered in turn. A file goes out piece by piece, the next one when
/// the client has taken the last, so that a slow client costs one piece of memory.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, const std::vector<OfferedFile>& offered, std::uint16_t port,
             std::shared_ptr<std::size_t> open)
      : stream_(std::move(socket)), offered_(offered), port_(port), open_(std::move(open)) {
    ++*open_;
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() { --*open_; }

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
    const auto method = request.method_string();
    const auto target = request.target();
    reply_ = reply_to(
        {.method = {method.data(), method.size()},
         .target = {target.data(), target.size()},
         .host = field(request, http::field::host),
         .origin = field(request, http::field::origin),
         .range = field(request, http::field::range),
         .accepts_gzip = field(request, http::field::accept_encoding).find("gzip") != std::string_view::npos},
        offered_, port_);
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
  const std::vector<OfferedFile>& offered_;
  std::uint16_t port_;
  std::shared_ptr<std::size_t> open_;
};

}  // namespace

struct HttpServer::Inside {
  std::vector<OfferedFile> offered;  // outlives the connections
  std::shared_ptr<std::size_t> open = std::make_shared<std::size_t>(0);
  asio::io_context context{1};
  tcp::acceptor acceptor{context};
  asio::steady_timer timer{context};

  beast::error_code bind(std::uint16_t port) {
    beast::error_code error;
    const tcp::endpoint here(asio::ip::address_v4::loopback(), port);
    acceptor.close(error);
    acceptor.open(here.protocol(), error);
    if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor.bind(here, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    return error;
  }

  void accept() {
    acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error && *open < kMostConnections)
        std::make_shared<Connection>(std::move(socket), offered, acceptor.local_endpoint().port(), open)
            ->read();
      accept();
    });
  }

  void watch(const std::function<bool()>& stop) {
    timer.expires_after(std::chrono::milliseconds(100));
    timer.async_wait([this, &stop](beast::error_code error) {
      if (error || stop()) return context.stop();
      watch(stop);
    });
  }
};

Result<HttpServer> HttpServer::listen(std::uint16_t port, std::vector<OfferedFile> offered) {
  auto inside = std::make_unique<Inside>();
  inside->offered = std::move(offered);
  beast::error_code error = inside->bind(port);
  if (error && port != 0) error = inside->bind(0);
  if (error)
    return fail(ErrorCode::Unwritable, fmt::format("cannot listen on 127.0.0.1: {}", error.message()), {},
                "Another program may hold every port; try again.");
  return HttpServer(std::move(inside));
}

std::uint16_t HttpServer::port() const {
  beast::error_code none;
  return inside_->acceptor.local_endpoint(none).port();
}

void HttpServer::run(const std::function<bool()>& stop) {
  inside_->accept();
  inside_->watch(stop);
  inside_->context.run();
}

#else  // without Boost.Beast

namespace waymark {

struct HttpServer::Inside {};
Result<HttpServer> HttpServer::listen(std::uint16_t /*port*/, std::vector<OfferedFile> /*offered*/) {
  return fail(ErrorCode::Unsupported, "this program was built without Boost.Beast", {},
              "Install libboost-dev and build again.");
}
std::uint16_t HttpServer::port() const { return 0; }
void HttpServer::run(const std::function<bool()>& /*stop*/) {}

#endif

HttpServer::HttpServer(std::unique_ptr<Inside> inside) : inside_(std::move(inside)) {}
HttpServer::HttpServer(HttpServer&&) noexcept = default;
HttpServer& HttpServer::operator=(HttpServer&&) noexcept = default;
HttpServer::~HttpServer() = default;

}  // namespace waymark
