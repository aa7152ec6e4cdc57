// A robot with a camera of any rate: the images of a recording with their tags, read in advance, go through
// the real feed and server to the page, stamped at publication. For viewer/test/age.mjs, which measures their
// age on the screen; a simulator that renders 30 images per second would leave the browser no processor time.
// Ends with its input. usage: live_images RECORDING [HZ]
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include "waymark/recording/message_log.hpp"
#include "waymark/server/http_server.hpp"

namespace {

using namespace waymark;

constexpr std::size_t kMaxImages = 300;  // 92 MB

struct Seen {
  CameraFrame image{};
  TagFrame tags{};
  Odometry odometry{};
};

Result<std::vector<Seen>> read(MessageLog& log) {
  std::vector<Seen> all;
  Seen next;
  const Status status = log.visit_samples({}, [&](const Sample& sample) -> Status {
    if (const auto* odometry = std::get_if<Odometry>(&sample)) next.odometry = *odometry;
    if (const auto* image = std::get_if<CameraFrame>(&sample)) next.image = *image;
    const auto* tags = std::get_if<TagFrame>(&sample);
    if (tags == nullptr || tags->stamp != next.image.stamp || all.size() >= kMaxImages) return {};
    next.tags = *tags;
    all.push_back(next);
    return {};
  });
  if (!status) return tl::unexpected(status.error());
  if (all.empty()) return fail(ErrorCode::NotFound, "no images with tags of the same stamp");
  return all;
}

bool input_ended() {
  pollfd ready{STDIN_FILENO, POLLIN, 0};
  char byte = 0;
  return poll(&ready, 1, 0) > 0 && ::read(STDIN_FILENO, &byte, 1) <= 0;
}

/// Back and forth through the recording, so that nothing jumps.
void publish_all(LiveFeed& feed, const std::vector<Seen>& seen, double hz) {
  using Clock = std::chrono::steady_clock;
  const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / hz));
  const std::size_t turn = 2 * seen.size();
  auto next = Clock::now();
  for (std::size_t i = 0; !input_ended(); ++i, next += period) {
    std::this_thread::sleep_until(next);
    const std::size_t at = i % turn;
    Seen now = seen[at < seen.size() ? at : turn - 1 - at];
    const std::int64_t now_ns = std::chrono::system_clock::now().time_since_epoch().count();
    now.image.stamp = now.tags.stamp = now.odometry.stamp = SensorTime(Duration(now_ns));
    feed.publish(Sample(now.odometry), now_ns);
    feed.publish(Sample(std::move(now.image)), now_ns);
    feed.publish(Sample(std::move(now.tags)), now_ns);
    feed.set_status({.phase = "replaying", .driven_m = static_cast<double>(i) / hz});
  }
}

Status run(const char* path, double hz) {
  const auto log = open_log(path);
  if (!log) return tl::unexpected(log.error());
  const auto seen = read(**log);
  if (!seen) return tl::unexpected(seen.error());
  const auto setup = (*log)->setup();
  if (!setup) return tl::unexpected(setup.error());
  LiveFeed feed;
  auto server = HttpServer::listen({.port = 0, .feed = &feed, .robot_name = "images"});
  if (!server) return tl::unexpected(server.error());
  if (setup->camera && setup->base_T_cam) feed.show_camera(*setup->camera, *setup->base_T_cam);
  std::atomic<bool> over{false};
  std::thread serving([&] { server->run([&] { return over.load(); }); });
  std::puts(server->url().c_str());
  std::fflush(stdout);
  publish_all(feed, *seen, hz);
  over = true;
  serving.join();
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: live_images RECORDING [HZ]\n", stderr);
    return 2;
  }
  const waymark::Status status = run(argv[1], argc > 2 ? std::atof(argv[2]) : 30);
  if (status) return 0;
  std::fputs(to_string(status.error()).c_str(), stderr);
  return 1;
}
