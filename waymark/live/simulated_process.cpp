#include "waymark/live/simulated_process.hpp"

#include <chrono>
#include <cstdio>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/drivers/process/robot_messages.hpp"
#include "waymark/drivers/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr Duration kOrderPeriod = std::chrono::milliseconds(50);
constexpr int kPictureQuality = 92;

/// The orders on standard input.
class OrderInput {
 public:
  /// The newest order that came until now; waits up to `most` for one.
  std::optional<RobotOrderLine> newest(Duration most) {
    pollfd ready{STDIN_FILENO, POLLIN, 0};
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(most).count();
    std::optional<RobotOrderLine> found;
    while (!ended_ && poll(&ready, 1, found ? 0 : static_cast<int>(ms)) > 0) {
      std::string bytes;
      ended_ = read_some(STDIN_FILENO, bytes) == Moved::Ended;
      lines_.add(bytes);
      while (const auto line = lines_.next()) {
        const RobotOrderLine order = parse_order_line(line->text);
        ended_ = ended_ || order.kind == RobotOrderLine::Kind::Bye;
        if (order.kind == RobotOrderLine::Kind::Velocity) found = order;
        if (found && found->step == answer_to_ && answer_to_ != 0) return found;
      }
    }
    return found;
  }
  /// Only the answer to this step counts.
  void wait_for(std::int64_t step) { answer_to_ = step; }
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  LineSplitter lines_{};
  std::int64_t answer_to_ = 0;
  bool ended_ = false;
};

/// A simulated robot that speaks on standard output and listens on standard input.
class SimulatedProcess {
 public:
  SimulatedProcess(Plant& plant, std::string name, bool pictures, const SimulatedProcessOptions& options,
                   std::function<bool()> cancelled)
      : plant_(plant),
        name_(std::move(name)),
        pictures_(pictures),
        lockstep_(options.lockstep),
        pace_(options.pace),
        cancelled_(std::move(cancelled)) {}

  Status run() {
    RobotHello hello{.name = name_, .lockstep = lockstep_, .simulated = true};
    hello.sends = {"odometry", "wheels", "imu", "truth", pictures_ ? "image" : "detections"};
    Status status = write(to_line(hello));
    start_ = steady_now();
    Duration next_order{};
    while (status && !over()) {
      const auto sample = plant_.next();
      status = sample ? send(*sample) : tl::unexpected(sample.error());
      if (!status || plant_.uptime() < next_order) continue;
      next_order += kOrderPeriod;
      status = lockstep_ ? step_in_lockstep() : step_in_time();
    }
    return over() ? Status() : status;
  }

 private:
  [[nodiscard]] bool over() const { return orders_.ended() || reader_gone_ || cancelled_(); }

  Status write(const std::string& line) {
    const bool written = std::fwrite(line.data(), 1, line.size(), stdout) == line.size();
    reader_gone_ = !written;
    return {};
  }

  Status send(const Sample& sample) {
    const auto* frame = std::get_if<CameraFrame>(&sample);
    if (frame == nullptr) return write(to_line(sample));
    const auto jpeg = encode_jpeg(frame->image, kPictureQuality);
    if (!jpeg) return tl::unexpected(jpeg.error());
    return write(to_line(sample, *jpeg));
  }

  Status step_in_lockstep() {
    const std::int64_t step = ++step_;
    Status status = write(to_line(RobotStep{step, plant_.now()}));
    (void)std::fflush(stdout);
    if (pace_ > 0) keep_pace();
    orders_.wait_for(step);
    while (status && !over()) {
      const auto order = orders_.newest(std::chrono::milliseconds(100));
      if (order && order->step == step) return plant_.command(order->command);
    }
    return status;
  }

  /// What a busy host was late by is not made up for: a robot must not drive faster than commanded.
  void keep_pace() {
    const Duration due(static_cast<std::int64_t>(static_cast<double>(plant_.uptime().count()) / pace_));
    const Duration ahead = start_ + due - steady_now();
    if (ahead > Duration(0)) std::this_thread::sleep_for(ahead);
    if (ahead < -kOrderPeriod) start_ -= ahead + kOrderPeriod;
  }

  Status step_in_time() {
    (void)std::fflush(stdout);
    const Duration ahead = start_ + plant_.uptime() - steady_now();
    if (ahead > Duration(0)) std::this_thread::sleep_for(ahead);
    const auto order = orders_.newest(Duration(0));
    return order ? plant_.command(order->command) : Status();
  }

  Plant& plant_;
  std::string name_;
  bool pictures_;
  bool lockstep_;
  double pace_;
  std::function<bool()> cancelled_;
  OrderInput orders_{};
  Duration start_{};
  std::int64_t step_ = 0;
  bool reader_gone_ = false;
};

}  // namespace

Status run_simulated_process(Plant& plant, const SimulatedSetup& setup,
                             const SimulatedProcessOptions& options, const std::function<bool()>& cancelled) {
  never_wait(STDIN_FILENO);
  return SimulatedProcess(plant, setup.model.name, setup.pictures.has_value(), options, cancelled).run();
}

}  // namespace waymark
