// Cost of viewers for the loop of a robot: the time of one round (samples published, a fixed amount of work
// done), without viewers and with four that read everything and one that never reads. The order is without,
// with, with, without, so that other load on the machine affects both alike. Prints a table of all rounds,
// and the ratio of p99 turn by turn with its scatter. For comparison, the same ratio between the two segments
// without viewers shows the effect of the machine alone. usage: live_loop_benchmark [TURNS [SECONDS]]
// SECONDS of each of the four segments
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
#include <sys/resource.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "waymark/server/http_server.hpp"

namespace {

using namespace waymark;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPeriod{10};
constexpr int kRoundsPerImage = 3;  // 33 per second

/// A WebSocket as plain bytes: requests the upgrade, subscribes to all topics, and reads or does not.
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
    send(fmt::format(
        "GET / HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nUpgrade: websocket\r\nConnection: "
        "Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n",
        port));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    std::string wanted = R"({"op":"subscribe","subscriptions":[)";
    for (int i = 0; i < 5; ++i)  // state, image, tags, odometry, frames
      wanted += fmt::format(R"({}{{"id":{},"channelId":{}}})", i == 0 ? "" : ",", i, i);
    send_frame(wanted + "]}");
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
  void send(const std::string& text) {
    if (::send(socket_, text.data(), text.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(text.size()))
      std::abort();
  }
  /// Masked with zeros: a client must mask.
  void send_frame(const std::string& text) {
    std::string frame = "\x81\xfe";
    frame += static_cast<char>(text.size() >> 8U);
    frame += static_cast<char>(text.size() & 0xffU);
    send(frame + std::string(4, '\0') + text);
  }
  /// Reads like a viewer on another computer, which takes no time from the robot's.
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

/// A millisecond of work, like a detector's, that compilers cannot remove.
std::uint64_t work(const std::vector<std::uint8_t>& pixels) {
  std::uint64_t sum = 0;
  for (int pass = 0; pass < 4; ++pass) {
    for (const std::uint8_t pixel : pixels) sum = sum * 31 + pixel;
  }
  return sum;
}

Image noise_image() {
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

/// Of rounds of the loop [ms].
struct Rounds {
  std::vector<double> took{};
  std::vector<double> processor{};  ///< processor time of the round
  std::vector<double> published{};  ///< time for publishing
  long interrupted = 0;             ///< number of preemptions

  void add(const Rounds& more) {
    for (const auto part : {&Rounds::took, &Rounds::processor, &Rounds::published})
      (this->*part).insert((this->*part).end(), (more.*part).begin(), (more.*part).end());
    interrupted += more.interrupted;
  }
};

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

double processor_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

long interruptions() {
  rusage used{};
  getrusage(RUSAGE_THREAD, &used);
  return used.ru_nivcsw;
}

void publish(LiveFeed& feed, const Sample& image, int round) {
  const std::int64_t now_ns = std::chrono::system_clock::now().time_since_epoch().count();
  const SensorTime stamp{Duration(now_ns)};
  if (round % kRoundsPerImage == 0) {
    feed.publish(image, now_ns);
    feed.publish(Sample(TagFrame{.stamp = stamp}), now_ns);
  }
  feed.publish(Sample(Odometry{.stamp = stamp}), now_ns);
  feed.set_status({.phase = "replaying", .driven_m = round * 0.001});
}

Rounds rounds_of(LiveFeed& feed, const CameraFrame& image, double seconds, std::uint64_t& sum) {
  const std::vector<std::uint8_t> pixels(640 * 480, 7);
  const Sample seen(image);
  Rounds rounds;
  Clock::time_point next = Clock::now();
  const auto end = next + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  for (int round = 0; next < end; ++round, next += kPeriod) {
    std::this_thread::sleep_until(next);
    const long before = interruptions();
    const double processor = processor_ms();
    const auto start = Clock::now();
    publish(feed, seen, round);
    rounds.published.push_back(ms_since(start));
    sum += work(pixels);
    rounds.took.push_back(ms_since(start));
    rounds.processor.push_back(processor_ms() - processor);
    rounds.interrupted += interruptions() - before;
  }
  return rounds;
}

double quantile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// The server, its viewers if there are any, and the loop.
class Bench {
 public:
  explicit Bench(HttpServer& server, LiveFeed& feed) : server_(server), feed_(feed) {
    static_cast<void>(rounds_of(feed_, image_, 1, sum));
    const Viewer first(server_.port(), true);  // creates the channels
    static_cast<void>(rounds_of(feed_, image_, 0.5, sum));
  }
  Rounds stretch(bool watched, double seconds) {
    std::vector<std::unique_ptr<Viewer>> viewers;
    for (int v = 0; watched && v < 5; ++v) viewers.push_back(std::make_unique<Viewer>(server_.port(), v > 0));
    static_cast<void>(rounds_of(feed_, image_, 0.3, sum));
    Rounds rounds = rounds_of(feed_, image_, seconds, sum);
    for (const auto& viewer : viewers) bytes += viewer->bytes();
    viewers.clear();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));  // until they are gone
    return rounds;
  }
  std::uint64_t bytes = 0;
  std::uint64_t sum = 0;

 private:
  HttpServer& server_;
  LiveFeed& feed_;
  CameraFrame image_{.image = noise_image()};
};

void print_ratio(const char* name, const std::vector<double>& ratios) {
  fmt::print("{:<46} median {:.3f}, quartiles {:.3f} to {:.3f}, of {}\n", name, quantile(ratios, 0.5),
             quantile(ratios, 0.25), quantile(ratios, 0.75), ratios.size());
}

void print_rounds(const char* name, const Rounds& rounds) {
  fmt::print("{:<32}", name);
  for (const auto* values : {&rounds.took, &rounds.processor, &rounds.published})
    fmt::print(" {:>7.3f} {:>7.3f} {:>7.3f} ", quantile(*values, 0.5), quantile(*values, 0.99),
               quantile(*values, 1));
  fmt::print("{:>8.2f}\n",
             100.0 * static_cast<double>(rounds.interrupted) / static_cast<double>(rounds.took.size()));
}

}  // namespace

int main(int argc, char** argv) {
  const int turns = argc > 1 ? std::atoi(argv[1]) : 10;
  const double seconds = argc > 2 ? std::atof(argv[2]) : 3;
  LiveFeed feed;
  auto server =
      HttpServer::listen({.port = 0, .token = "0123456789abcdef", .feed = &feed, .robot_name = "benchmark"});
  if (!server) {
    std::fputs(to_string(server.error()).c_str(), stderr);
    return 1;
  }
  std::atomic<bool> over{false};
  std::thread serving([&] { server->run([&] { return over.load(); }); });
  Bench bench(*server, feed);
  Rounds alone;
  Rounds watched;
  std::vector<double> ratios;
  std::vector<double> nulls;
  for (int i = 0; i < turns; ++i) {
    Rounds without = bench.stretch(false, seconds);
    Rounds with = bench.stretch(true, seconds);
    with.add(bench.stretch(true, seconds));
    const Rounds again = bench.stretch(false, seconds);
    nulls.push_back(quantile(again.took, 0.99) / quantile(without.took, 0.99));
    without.add(again);
    ratios.push_back(quantile(with.took, 0.99) / quantile(without.took, 0.99));
    alone.add(without);
    watched.add(with);
  }
  over = true;
  serving.join();
  fmt::print("{:<32} {:^24}{:^24}{:^24}{:>8}\n", "a round of the loop [ms]", "took", "on the processor",
             "publishing", "inter-");
  fmt::print("{:<32}", "");
  for (int i = 0; i < 3; ++i) fmt::print(" {:>7} {:>7} {:>7} ", "p50", "p99", "most");
  fmt::print("{:>8}\n", "rupted %");
  print_rounds("without viewers", alone);
  print_rounds("four viewers, one never reads", watched);
  print_ratio("p99 with viewers / without, turn by turn", ratios);
  print_ratio("p99 without / without (the machine alone)", nulls);
  fmt::print(
      "p99 ratio of all rounds {:.3f}; {} rounds each, {:.0f} MB to the viewers, {} samples dropped ({})\n",
      quantile(watched.took, 0.99) / quantile(alone.took, 0.99), alone.took.size(),
      static_cast<double>(bench.bytes) * 1e-6, feed.dropped(), bench.sum % 2 == 0 ? "even" : "odd");
  return 0;
}
