#include "waymark/server/http_server.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace waymark {
namespace {

constexpr const char* kToken = "0123456789abcdef";

/// A connection to a port on this machine, whose reads time out after one second.
class Client {
 public:
  explicit Client(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const timeval patience{.tv_sec = 20, .tv_usec = 0};  // only a stopped server takes so long
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~Client() { ::close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void send(const std::string& bytes) const {
    EXPECT_TRUE(connected_);
    (void)::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }
  /// Sends a WebSocket text frame (RFC 6455, section 5.2), masked with zeros.
  void send_text(const std::string& text) const {
    send(std::string("\x81") + static_cast<char>(0x80U | text.size()) + std::string(4, '\0') + text);
  }
  /// The next bytes received; empty at the end of the stream.
  [[nodiscard]] std::string receive() const {
    std::array<char, 65536> bytes{};
    const ssize_t count = ::recv(socket_, bytes.data(), bytes.size(), 0);
    return {bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0))};
  }

 private:
  int socket_;
  bool connected_ = false;
};

std::string upgrade(std::uint16_t port, const std::string& target) {
  return "GET " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
         "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: "
         "AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Protocol: waymark.v1\r\n\r\n";
}

TEST(HttpServer, ViewersConnectAndDisconnectDuringTheRobotLoop) {
  LiveFeed feed;
  auto server = HttpServer::listen({.port = 0, .token = kToken, .feed = &feed, .robot_name = "limo"});
  ASSERT_TRUE(server) << to_string(server.error());
  std::atomic<bool> over{false};
  std::atomic<int> greeted{0};
  const std::uint16_t port = server->port();
  std::thread serving([&] { server->run([&] { return over.load(); }); });
  std::thread viewing([&] {
    for (int i = 0; i < 100; ++i) {
      const Client client(port);
      client.send(upgrade(port, i % 2 == 0 ? "/live" : std::string("/live?token=") + kToken));
      if (client.receive().starts_with("HTTP/1.1 101")) ++greeted;
      client.send_text(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":1}]})");
      client.send_text(R"({"op":"order","order":"stop"})");
      (void)client.receive();
    }
    over = true;
  });
  int stops = 0;
  for (std::int64_t i = 0; !over; ++i) {
    feed.publish(Sample(Odometry{.stamp = SensorTime(Duration(i))}), i);
    feed.set_status({.phase = i % 50 < 25 ? "teaching" : "idle"});
    for (const ViewerOrder& order : feed.take_orders())
      stops += order.kind == ViewerOrder::Kind::Stop ? 1 : 0;
    (void)feed.control();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  viewing.join();
  serving.join();
  EXPECT_EQ(greeted, 100);
  EXPECT_GT(stops, 50);
}

TEST(HttpServer, DropsConnectionsWithUnfinishedRequests) {
  auto server = HttpServer::listen({.port = 0});
  ASSERT_TRUE(server) << to_string(server.error());
  std::atomic<bool> over{false};
  std::thread serving([&] { server->run([&] { return over.load(); }); });
  std::vector<std::unique_ptr<Client>> slow;
  for (int i = 0; i < 200; ++i) {
    slow.push_back(std::make_unique<Client>(server->port()));
    slow.back()->send("GET / HTTP/1.1\r\n");
  }
  const Client quick(server->port());
  quick.send("GET /session.json HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(server->port()) + "\r\n\r\n");
  EXPECT_TRUE(quick.receive().starts_with("HTTP/1.1 200"));
  EXPECT_EQ(slow.front()->receive(), "") << "the oldest connection was closed";
  over = true;
  serving.join();
}

}  // namespace
}  // namespace waymark
