#include "waymark/app/robot/limo_robot_sim.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <termios.h>

#include "waymark/app/robot/plant.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/robots/limo/limo_messages.hpp"
#include "waymark/robots/process/robot_messages.hpp"
#include "waymark/robots/watchdog/device_file.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {

std::string WireFaults::pass(std::span<const std::uint8_t> frame) {
  constexpr std::uint64_t kValues = 256;
  if (!frame.empty() && random_.uniform() < options_.torn) frame = frame.first(random_.index(frame.size()));
  std::string received;
  for (const std::uint8_t byte : frame) {
    if (random_.uniform() < options_.dropped) continue;
    const bool hurt = random_.uniform() < options_.noise;
    received.push_back(static_cast<char>(hurt ? random_.index(kValues) : byte));
  }
  return received;
}

namespace {

constexpr int kBesideQuality = 92;
constexpr std::size_t kMaxWaitingBytes = std::size_t{1} << 20U;
constexpr double kBatteryVolts = 11.8;
constexpr Duration kStatePeriod = std::chrono::milliseconds(100);

/// Keeps both ends of a pseudo-terminal open, so that it does not hang up when no driver is connected.
struct Terminal {
  Descriptor master;
  Descriptor slave;
  std::string path;
};

Result<Terminal> make_terminal() {
  Terminal made{
      .master = Descriptor(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)), .slave = Descriptor(), .path = {}};
  std::array<char, 128> path{};
  if (!made.master.open() || ::grantpt(made.master.number()) != 0 || ::unlockpt(made.master.number()) != 0 ||
      ::ptsname_r(made.master.number(), path.data(), path.size()) != 0)
    return fail(ErrorCode::Unwritable, "cannot create a pseudo-terminal");
  made.path = path.data();
  made.slave = Descriptor(::open(path.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  termios line{};
  if (!made.slave.open() || ::tcgetattr(made.slave.number(), &line) != 0)
    return fail(ErrorCode::Unwritable, "cannot open the pseudo-terminal", {.source = made.path});
  ::cfmakeraw(&line);
  (void)::tcsetattr(made.slave.number(), TCSANOW, &line);
  never_wait(made.master.number());
  return made;
}

Result<Descriptor> open_pipe(const std::string& path) {
  if (path.empty()) return Descriptor();
  (void)::mkfifo(path.c_str(), 0600);
  struct stat node {};
  Descriptor pipe(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!pipe.open() || ::fstat(pipe.number(), &node) != 0 || !S_ISFIFO(node.st_mode))
    return fail(ErrorCode::Unwritable, "not a named pipe, and one cannot be created here", {.source = path},
                "Choose a path that does not exist.");
  if (::flock(pipe.number(), LOCK_EX | LOCK_NB) != 0)
    return fail(ErrorCode::InvalidArgument,
                "another simulated robot writes to this named pipe" +
                    (holder_of(path).empty() ? "" : ": " + holder_of(path)),
                {.source = path}, "End that robot, or use another pipe for this robot and its driver.");
  return pipe;
}

class LimoRobotSim {
 public:
  LimoRobotSim(Plant& plant, const SimulatedSetup& setup, const LimoSimOptions& options, Terminal terminal,
               Descriptor pipe)
      : wheel_radius_m_(setup.model.wheel_radius_m),
        plant_(plant),
        terminal_(std::move(terminal)),
        pipe_(std::move(pipe)),
        out_(options.faults, 2 * setup.robot.seed),
        in_(options.faults, 2 * setup.robot.seed + 1) {
    if (setup.robot.dynamics.drive == "ackermann") state_.drive = LimoDrive::Ackermann;
  }

  Status run(const JobControl& control) {
    const auto& should_stop = control.cancelled;
    switched_on_ = steady_now() - plant_.uptime();
    PlantPace pace(steady_now, plant_.uptime(), control.note);
    Status status;
    while (status && !should_stop()) {
      auto sample = plant_.next();
      status = sample ? speak(std::move(*sample), pace.left_out()) : tl::unexpected(sample.error());
      write_lines();
      pace.leave_out(plant_.uptime());
      do {  // loop until the next sample is due, but at least until all waiting bytes are read
        obey(pace.ahead(plant_.uptime()));
      } while (pace.ahead(plant_.uptime()) > Duration(0) && !should_stop());
    }
    return should_stop() ? Status() : status;
  }

 private:
  void obey(Duration most) {
    pollfd ready{terminal_.master.number(), POLLIN, 0};
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(most).count();
    if (::poll(&ready, 1, static_cast<int>(ms)) <= 0) return;
    std::string bytes;
    (void)read_some(terminal_.master.number(), bytes);
    const std::string received =
        in_.pass({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    reader_.add({reinterpret_cast<const std::uint8_t*>(received.data()), received.size()});
    while (const auto frame = reader_.next()) {
      if (static_cast<LimoId>(frame->id) == LimoId::ControlMode && frame->data[0] == 1) {
        state_.commanded = true;
        if (frame->data[2] == 1) state_.drive = LimoDrive::Mecanum;
      }
      if (static_cast<LimoId>(frame->id) == LimoId::Motion && state_.commanded)
        (void)plant_.command(decode_command(*frame, state_.drive));
    }
  }

  /// Drops data that the driver does not read in time, as a serial line does.
  void put(const LimoFrame& frame) {
    const std::string bytes = out_.pass(encode(frame));
    std::size_t written = 0;
    (void)write_some(terminal_.master.number(), bytes, written);
  }

  Status speak(Sample sample, Duration left_out) {
    std::visit([&](auto& value) { value.stamp += switched_on_ + left_out; }, sample);
    return std::visit([this](const auto& value) { return publish_item(value); }, sample);
  }

  Status publish_item(const Odometry& odometry) {
    const bool steered = state_.drive == LimoDrive::Ackermann;
    const double curvature = odometry.speed_m_s != 0 ? odometry.yaw_rate_rad_s / odometry.speed_m_s : 0;
    put(encode_motion_feedback({.speed_m_s = odometry.speed_m_s,
                                .yaw_rate_rad_s = steered ? 0 : odometry.yaw_rate_rad_s,
                                .steering_rad = steered ? steering_of_curvature(curvature) : 0}));
    if (odometry.stamp < next_state_) return {};
    next_state_ = odometry.stamp + kStatePeriod;
    put(encode_state(state_));
    return {};
  }
  Status publish_item(const WheelTicks& wheels) {
    put(encode_odometer({wheel_radius_m_ * wheels.left_rad, wheel_radius_m_ * wheels.right_rad}));
    return {};
  }
  Status publish_item(const ImuSample& imu) {
    if (imu_at_ != SensorTime()) yaw_rad_ += to_seconds(imu.stamp - imu_at_) * imu.angular_velocity_rad_s.z();
    imu_at_ = imu.stamp;
    put(encode_acceleration(imu.linear_acceleration_m_s2));
    put(encode_angular_velocity(imu.angular_velocity_rad_s));
    put(encode_attitude({SO2(yaw_rad_).angle(), 0, 0}));
    return {};
  }
  Status publish_item(const CameraFrame& frame) {
    if (!pipe_.open()) return {};
    const auto jpeg = encode_jpeg(frame.image, kBesideQuality);
    if (!jpeg) return tl::unexpected(jpeg.error());
    lines_.push(to_line(frame, *jpeg));
    return {};
  }
  template <class Other>
  Status publish_item(const Other& sample) {
    if (std::string line = to_line(sample); pipe_.open() && !line.empty()) lines_.push(std::move(line));
    return {};
  }

  void write_lines() {
    while (pipe_.open() && !lines_.empty()) {
      std::size_t written = 0;
      if (write_some(pipe_.number(), lines_.front(), written) != Moved::Some) return;
      lines_.pop(written);
    }
  }

  double wheel_radius_m_;
  Plant& plant_;
  Terminal terminal_;
  Descriptor pipe_;
  WireFaults out_;
  WireFaults in_;
  LimoReader reader_{};
  LineQueue lines_{kMaxWaitingBytes};
  LimoState state_{.battery_V = kBatteryVolts};
  SensorTime next_state_{};
  SensorTime imu_at_{};
  double yaw_rad_ = 0;
  Duration switched_on_{};  ///< time on the steady clock of this machine
};

}  // namespace

Status run_limo_robot_sim(Plant& plant, const SimulatedSetup& setup, const LimoSimOptions& options,
                          const std::function<void(const std::string&)>& on_port, const JobControl& control) {
  auto terminal = make_terminal();
  if (!terminal) return tl::unexpected(terminal.error());
  auto pipe = open_pipe(options.beside);
  if (!pipe) return tl::unexpected(pipe.error());
  on_port(terminal->path);
  return LimoRobotSim(plant, setup, options, std::move(*terminal), std::move(*pipe)).run(control);
}

}  // namespace waymark
