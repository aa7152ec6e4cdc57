#include "waymark/server/live_socket.hpp"

#ifdef WAYMARK_HAVE_BEAST
#include <array>
#include <chrono>
#include <utility>
#include <vector>

#include <boost/asio/buffer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/field.hpp>
#include <boost/beast/websocket.hpp>

namespace waymark {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using Request = http::request<http::empty_body>;

constexpr std::size_t kMostMessageBytes = 64 * 1024;
/// A viewer that answers no ping for so long has gone, cable and all.
constexpr std::chrono::seconds kIdle{4};

}  // namespace

/// One viewer: reads and writes at the same time, one frame of each.
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
    stream_.set_option(websocket::stream_base::timeout{std::chrono::seconds(5), kIdle, true});
    stream_.set_option(websocket::stream_base::decorator([protocol](websocket::response_type& answer) {
      if (!protocol.empty()) answer.set(http::field::sec_websocket_protocol, protocol);
    }));
    stream_.read_message_max(kMostMessageBytes);
    stream_.auto_fragment(false);  // a picture is one frame: nothing is sent between its parts
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

  /// The server is going.
  void forget() { gone_ = true; }
  /// What waits for the connection ends with an error, and ends it.
  void hang_up() {
    beast::error_code ignored;
    beast::get_lowest_layer(stream_).socket().close(ignored);
  }

 private:
  void begin(const std::string& protocol, bool may_command) {
    const auto id = all_->hub_.join(protocol, may_command, all_->now_());
    if (!id) {  // the house is full
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
      all_->hub_.hear_text(id_, {static_cast<const char*>(data.data()), data.size()}, all_->now_());
    else
      all_->hub_.hear_binary(id_, {static_cast<const std::uint8_t*>(data.data()), data.size()}, all_->now_());
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
  OutFrame frame_;  ///< on its way
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
  std::vector<std::shared_ptr<LiveSocket>> all;  // write() may end one
  for (const auto& [id, weak] : sockets_) {
    if (auto socket = weak.lock()) all.push_back(std::move(socket));
  }
  for (const auto& socket : all) socket->write();
}

}  // namespace waymark
#endif
