#include "waymark/server/http_connection.hpp"

#ifdef WAYMARK_HAVE_BEAST
#include <algorithm>
#include <chrono>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

namespace waymark {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using asio::ip::tcp;

constexpr std::uint32_t kMostHeaderBytes = 8192;
constexpr std::chrono::seconds kPatience{30};
/// The head of a first request comes in one piece, unless somebody wants to keep a seat taken.
constexpr std::chrono::seconds kHeadPatience{5};
constexpr std::size_t kPieceBytes = std::size_t{256} * 1024;

std::string_view field(const http::request<http::empty_body>& request, http::field name) {
  const auto value = request[name];
  return {value.data(), value.size()};
}

/// A seat, given back when the connection that holds it, web socket or not, is gone.
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

/// One connection: requests are read and answered in turn. A file goes out piece by piece, the next one when
/// the client has taken the last, so that a slow client costs one piece of memory.
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
    read(kHeadPatience);
  }

 private:
  void read(std::chrono::seconds patience) {
    parser_.emplace();
    parser_->header_limit(kMostHeaderBytes);
    parser_->body_limit(0);
    stream_.expires_after(patience);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](beast::error_code error, std::size_t) {
                       if (!error) self->answer();
                       // what is no request, or too long, ends the connection
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
    stream_.expires_after(kPatience);
    http::async_write_header(stream_, *writer_,
                             [self = shared_from_this()](beast::error_code error, std::size_t) {
                               if (!error) self->write_body();
                             });
  }

  /// False: it is not let in, and gets an answer like any other request.
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
      return;  // shorter than it was: hang up
    left_ -= piece_.size();
    stream_.expires_after(kPatience);
    asio::async_write(stream_, asio::buffer(piece_),
                      [self = shared_from_this()](beast::error_code error, std::size_t) {
                        if (!error) self->write_piece();
                      });
  }

  void next() {
    if (keep_alive_) return read(kPatience);
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

}  // namespace

void serve_connection(tcp::socket socket, std::shared_ptr<SharedByConnections> shared) {
  const auto admission = shared->seats.admit();
  if (!admission) return;
  if (admission->dropped) shared->drop(*admission->dropped);
  std::make_shared<Connection>(std::move(socket), std::move(shared), admission->id)->begin();
}

}  // namespace waymark
#endif
