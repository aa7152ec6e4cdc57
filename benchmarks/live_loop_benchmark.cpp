// What viewers cost the loop of a robot: the time from one round's begin to its end (samples published, a
// fixed piece of work done), alone and with four viewers that read everything and one that never reads, in
// turns. A table: p50, p99 and worst, and the ratio. usage: live_loop_benchmark [ROUNDS [SECONDS]]
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>

#include "waymark/server/http_server.hpp"

namespace {

using namespace waymark;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPeriod{10};
constexpr int kPictureEvery = 3;  // 33 a second

/// A WebSocket as plain bytes: asks to be upgraded, subscribes to all, and reads, or does not.
class Viewer {
 public:
  Viewer(std::uint16_t port, bool reads) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    const int small = 4096;
    if (!reads) setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_port = htons(port);
    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(socket_, reinterpret_cast<const sockaddr*>(&here), sizeof here) != 0) std::abort();
    say(fmt::format(
        "GET / HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nUpgrade: websocket\r\nConnection: "
        "Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n",
        port));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    std::string wanted = R"({"op":"subscribe","subscriptions":[)";
    for (int i = 0; i < 5; ++i)  // state, picture, tags, odometry, frames
      wanted += fmt::format(R"({}{{"id":{},"channelId":{}}})", i == 0 ? "" : ",", i, i);
    say_frame(wanted + "]}");
    if (reads) thread_ = std::thread([this] { read_all(); });
  }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;
  ~Viewer() {
    shutdown(socket_, SHUT_RDWR);
    if (thread_.joinable()) thread_.join();
    close(socket_);
  }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  void say(const std::string& text) {
    if (send(socket_, text.data(), text.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(text.size()))
      std::abort();
  }
  /// Masked with zeros: a client must mask.
  void say_frame(const std::string& text) {
    std::string frame = "\x81\xfe";
    frame += static_cast<char>(text.size() >> 8U);
    frame += static_cast<char>(text.size() & 0xffU);
    say(frame + std::string(4, '\0') + text);
  }
  /// As a viewer on another computer: it takes no time from the robot's.
  void read_all() {
    const sched_param none{};
    static_cast<void>(sched_setscheduler(0, SCHED_IDLE, &none));
    std::vector<char> room(1 << 16);
    for (ssize_t got = 0; (got = recv(socket_, room.data(), room.size(), 0)) > 0;)
      bytes_ += static_cast<std::uint64_t>(got);
  }

  int socket_;
  std::thread thread_;
  std::atomic<std::uint64_t> bytes_{0};
};

/// A millisecond of work, as a detector would do, that no compiler leaves out.
std::uint64_t work(const std::vector<std::uint8_t>& pixels) {
  std::uint64_t sum = 0;
  for (int pass = 0; pass < 4; ++pass) {
    for (const std::uint8_t pixel : pixels) sum = sum * 31 + pixel;
  }
  return sum;
}

Image noise_picture() {
  Image image(640, 480);
  std::uint32_t state = 1;
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) {
      state = state * 1664525U + 1013904223U;
      const auto square = static_cast<std::uint32_t>(x / 8 + y / 8) % 2;
      image.row(y)[x] = static_cast<std::uint8_t>(96 + square * 64 + (state >> 28U));
    }
  }
  return image;
}

std::vector<double> rounds_of(LiveFeed& feed, const CameraFrame& picture, double seconds,
                              std::uint64_t& sum) {
  const std::vector<std::uint8_t> pixels(640 * 480, 7);
  std::vector<double> took_ms;
  Clock::time_point next = Clock::now();
  const auto end = next + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  for (int round = 0; next < end; ++round, next += kPeriod) {
    std::this_thread::sleep_until(next);
    const auto start = Clock::now();
    const std::int64_t now_ns = std::chrono::system_clock::now().time_since_epoch().count();
    const SensorTime stamp{Duration(now_ns)};
    if (round % kPictureEvery == 0) {
      CameraFrame frame = picture;
      frame.stamp = stamp;
      feed.publish(Sample(std::move(frame)), now_ns);
      feed.publish(Sample(TagFrame{.stamp = stamp}), now_ns);
    }
    feed.publish(Sample(Odometry{.stamp = stamp}), now_ns);
    feed.tell({.phase = "replaying", .driven_m = round * 0.001});
    sum += work(pixels);
    took_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - start).count());
  }
  return took_ms;
}

double quantile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc > 1 ? std::atoi(argv[1]) : 5;
  const double seconds = argc > 2 ? std::atof(argv[2]) : 10;
  LiveFeed feed;
  auto server =
      HttpServer::listen({.port = 0, .token = "0123456789abcdef", .feed = &feed, .robot_name = "benchmark"});
  if (!server) {
    std::fputs(to_string(server.error()).c_str(), stderr);
    return 1;
  }
  std::atomic<bool> over{false};
  std::thread serving([&] { server->run([&] { return over.load(); }); });
  const CameraFrame picture{.image = noise_picture()};
  std::uint64_t sum = 0;
  std::vector<double> alone;
  std::vector<double> watched;
  std::uint64_t bytes = 0;
  static_cast<void>(rounds_of(feed, picture, 1, sum));
  for (int i = 0; i < rounds; ++i) {
    for (const double ms : rounds_of(feed, picture, seconds, sum)) alone.push_back(ms);
    std::vector<std::unique_ptr<Viewer>> viewers;
    {
      const Viewer first(server->port(), true);  // makes the channels known
      static_cast<void>(rounds_of(feed, picture, 0.5, sum));
    }
    for (int v = 0; v < 5; ++v) viewers.push_back(std::make_unique<Viewer>(server->port(), v > 0));
    for (const double ms : rounds_of(feed, picture, seconds, sum)) watched.push_back(ms);
    for (const auto& viewer : viewers) bytes += viewer->bytes();
    viewers.clear();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
  over = true;
  serving.join();
  fmt::print("{:<34}{:>10}{:>10}{:>10}\n", "a round of the loop [ms]", "p50", "p99", "worst");
  for (const auto& [name, values] :
       {std::pair{"alone", alone}, std::pair{"four viewers, one never reads", watched}})
    fmt::print("{:<34}{:>10.3f}{:>10.3f}{:>10.3f}\n", name, quantile(values, 0.5), quantile(values, 0.99),
               quantile(values, 1));
  fmt::print("p99 ratio {:.3f}; {} rounds each, {:.0f} MB to the viewers, {} samples dropped ({})\n",
             quantile(watched, 0.99) / quantile(alone, 0.99), alone.size(), static_cast<double>(bytes) * 1e-6,
             feed.dropped(), sum % 2 == 0 ? "even" : "odd");
  return 0;
}
