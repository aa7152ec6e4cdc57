#include "waymark/app/robot/process_robot_sim.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include "waymark/app/robot/plant.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/robots/process/robot_messages.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr Duration kOrderPeriod = std::chrono::milliseconds(50);
constexpr int kImageQuality = 92;

/// Reads the commands from standard input.
class OrderInput {
 public:
  /// Returns the newest command; waits up to `most` for one.
  std::optional<RobotOrderLine> newest(Duration most) {
    pollfd ready{STDIN_FILENO, POLLIN, 0};
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(most).count();
    std::optional<RobotOrderLine> found;
    constexpr int kMaxReads = 100;  // ends the loop if the input never pauses
    for (int reads = 0; reads < kMaxReads && !ended_ && poll(&ready, 1, found ? 0 : static_cast<int>(ms)) > 0;
         ++reads) {
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
  /// Waits for the response to this step.
  void wait_for(std::int64_t step) { answer_to_ = step; }
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  LineSplitter lines_{};
  std::int64_t answer_to_ = 0;
  bool ended_ = false;
};

/// A simulated robot that communicates through standard input and output.
class SimulatedProcess {
 public:
  SimulatedProcess(Plant& plant, std::string name, bool images, const ProcessSimOptions& options,
                   const JobControl& control)
      : plant_(plant),
        name_(std::move(name)),
        images_(images),
        lockstep_(options.lockstep),
        factor_(options.lockstep ? options.pace : 1),
        cancelled_(control.cancelled),
        // In lockstep the pace is only an upper limit.
        pace_(steady_now, due(), lockstep_ ? [](const std::string&) {} : control.note) {}

  Status run() {
    RobotHello hello{.name = name_, .lockstep = lockstep_, .simulated = true};
    hello.sends = {"odometry", "wheels", "imu", "truth", images_ ? "image" : "detections"};
    Status status = write(to_line(hello));
    Duration next_order{};
    while (status && !over()) {
      auto sample = plant_.next();
      status = sample ? send(std::move(*sample)) : tl::unexpected(sample.error());
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

  /// The plant's uptime according to this computer's clock.
  [[nodiscard]] Duration due() const {
    return factor_ > 0 ? Duration(std::llround(static_cast<double>(plant_.uptime().count()) / factor_))
                       : Duration(0);
  }

  Status send(Sample sample) {
    if (!lockstep_) std::visit([this](auto& value) { value.stamp += pace_.left_out(); }, sample);
    const auto* frame = std::get_if<CameraFrame>(&sample);
    if (frame == nullptr) return write(to_line(sample));
    const auto jpeg = encode_jpeg(frame->image, kImageQuality);
    if (!jpeg) return tl::unexpected(jpeg.error());
    return write(to_line(sample, *jpeg));
  }

  Status step_in_lockstep() {
    const std::int64_t step = ++step_;
    Status status = write(to_line(RobotStep{step, plant_.now()}));
    (void)std::fflush(stdout);
    if (factor_ > 0) keep_pace();
    orders_.wait_for(step);
    while (status && !over()) {
      const auto order = orders_.newest(std::chrono::milliseconds(100));
      if (order && order->step == step) return plant_.command(order->command);
    }
    return status;
  }

  void keep_pace() {
    pace_.leave_out(due());
    std::this_thread::sleep_for(pace_.ahead(due()));
  }

  Status step_in_time() {
    (void)std::fflush(stdout);
    keep_pace();
    const auto order = orders_.newest(Duration(0));
    return order ? plant_.command(order->command) : Status();
  }

  Plant& plant_;
  std::string name_;
  bool images_;
  bool lockstep_;
  double factor_;  ///< maximum real-time factor; unlimited if 0
  std::function<bool()> cancelled_;
  PlantPace pace_;
  OrderInput orders_{};
  std::int64_t step_ = 0;
  bool reader_gone_ = false;
};

}  // namespace

Status run_process_robot_sim(Plant& plant, const SimulatedSetup& setup, const ProcessSimOptions& options,
                             const JobControl& control) {
  never_wait(STDIN_FILENO);
  return SimulatedProcess(plant, setup.model.name, setup.images.has_value(), options, control).run();
}

}  // namespace waymark
