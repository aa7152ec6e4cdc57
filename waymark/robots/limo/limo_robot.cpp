#include "waymark/robots/limo/limo_robot.hpp"

#include <array>
#include <memory>
#include <mutex>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>

#include "waymark/robots/limo/command_gate.hpp"
#include "waymark/robots/limo/limo_bridge.hpp"
#include "waymark/robots/limo/serial_port.hpp"
#include "waymark/robots/process/robot_messages.hpp"
#include "waymark/robots/wire/wire_loop.hpp"

namespace waymark {
namespace {

constexpr int kSlice_ms = 20;
constexpr double kLowBatteryVolts = 10.5;
constexpr Duration kMaxFrameGap = std::chrono::milliseconds(100);  // five motion frames
constexpr Duration kFrozen = std::chrono::seconds(1);
constexpr Duration kMaxWaitForInput = std::chrono::seconds(1);

class LimoRobot final : public WireLoop {
 public:
  LimoRobot(const RobotDescription& robot, const LimoRobotOptions& options, const RobotWire& wire)
      : WireLoop(wire, {.commands_before_hello = true}),
        name_(robot.model.name),
        options_(options),
        bridge_(robot.model.wheel_radius_m),
        gate_(options.drive),
        silence_(
            kMaxFrameGap,
            {{.after = kFrozen,
              .text = options.port + ": LIMO has stopped sending frames. Check that it is on and that the "
                                     "cable of its mainboard is plugged in; if it does not respond, restart "
                                     "it"}}) {}

  /// Opens the port; to be called before run().
  Status open() {
    auto port = open_serial_port(options_.port);
    if (!port) return tl::unexpected(port.error());
    port_ = std::move(*port);
    return open_beside();
  }

 private:
  Status open_beside() {
    if (options_.beside.empty()) return {};
    beside_ = Descriptor(::open(options_.beside.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    if (beside_.open()) return {};
    return fail(ErrorCode::NotFound, "no such named pipe", {.source = options_.beside},
                "Create it: mkfifo " + options_.beside);
  }

  /// Requests control in place of the sender, whose input has ended.
  void request_control() {
    constexpr Duration kEvery = std::chrono::milliseconds(50);
    if (listens() || steady_now() - asked_at_ < kEvery) return;
    asked_at_ = steady_now();
    send({});
  }

  void send(const VelocityCommand& asked) override {
    const std::scoped_lock lock(mutex_);
    const Duration now = steady_now();
    const VelocityCommand passed = gate_.pass(asked, now);
    if (gate_.asks_for_command(now)) put(take_command(options_.drive));
    put(encode_command(passed, gate_.drive()));
  }

  /// Ignores errors, because frames are soon repeated.
  void put(const LimoFrame& frame) {
    const auto bytes = encode(frame);
    std::size_t written = 0;
    (void)write_some(port_.number(), {reinterpret_cast<const char*>(bytes.data()), bytes.size()}, written);
  }

  Status poll_robot() override {
    std::array<pollfd, 2> fds{{{port_.number(), POLLIN, 0}, {beside_.number(), POLLIN, 0}}};
    (void)poll(fds.data(), fds.size(), kSlice_ms);
    std::string bytes;
    if (read_some(port_.number(), bytes) == Moved::Ended) return cut();
    bytes_ += bytes.size();
    reader_.add({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    const Duration arrived = steady_now();
    while (const auto frame = reader_.next()) receive(*frame, arrived);
    pass_beside();
    report_gate();
    return {};
  }

  /// Also reports to the driving program.
  Status cut() {
    const char* text = "the serial port is gone: LIMO cannot be stopped through it";
    const char* advice = "Check the cable, and that LIMO is on.";
    if (greeted()) {
      output().report(fmt::format("{}: {}. {}", options_.port, text, advice));
      return fail(ErrorCode::Unreadable, "the serial port is gone", {.source = options_.port});
    }
    return fail(ErrorCode::Unreadable, text, {.source = options_.port}, advice);
  }

  void receive(const LimoFrame& frame, Duration arrived) {
    ++frames_;
    frame_at_ = arrived;
    const bool lost = std::exchange(skipped_, reader_.skipped()) != reader_.skipped();
    LimoDrive drive{};
    {
      const std::scoped_lock lock(mutex_);
      const auto id = static_cast<LimoId>(frame.id);
      if (id == LimoId::State)
        if (const auto state = decode_state(frame)) gate_.receive(*state, arrived);
      if (id == LimoId::MotionFeedback)
        if (const auto motion = decode_motion(frame)) gate_.receive(*motion, arrived);
      drive = gate_.drive();
    }
    for (const Sample& sample : bridge_.receive(frame, drive, arrived, lost))
      if (const std::string line = to_line(sample); greeted() && !line.empty()) output().write({line});
  }

  void pass_beside() {
    std::string bytes;
    if (!beside_.open() || read_some(beside_.number(), bytes) != Moved::Some) return;
    lines_.add(bytes);
    // Lines that arrive before the hello belong to an earlier drive. A previous reader may have left half a
    // line.
    while (const auto line = lines_.next())
      if (greeted() && line->text.starts_with('{') && line->text.ends_with('}'))
        output().write({line->text + "\n"});
  }

  /// True if LIMO accepts commands, or if it sends data and no control was requested. If the input ends
  /// before LIMO accepts commands (/dev/null), the process ends afterwards.
  Result<bool> ready() override {
    if (input_ended()) request_control();
    const std::scoped_lock lock(mutex_);
    const auto& state = gate_.state();
    if (state && (state->drive == LimoDrive::Ackermann) != (options_.drive == LimoDrive::Ackermann))
      return fail(ErrorCode::InvalidArgument,
                  fmt::format("LIMO's drive is {}, but the robot file has {}", to_string(state->drive),
                              to_string(options_.drive)),
                  {.source = options_.port},
                  state->drive == LimoDrive::Ackermann
                      ? "Set `robot_file=limo-ackermann`, or turn the latches."
                      : "Set `robot_file=limo`, or turn the latches.");
    // The driving program has not requested control and may be waiting for the hello before sending its first
    // command.
    const bool unasked = role() == InputRole::Unknown && !input_ended() && waited() >= kMaxWaitForInput;
    return gate_.ready() || ((unasked || listens()) && gate_.has_state());
  }

  RobotHello hello() const override { return {.name = name_, .simulated = options_.simulated}; }

  void after_hello() override {
    const std::scoped_lock lock(mutex_);
    const double battery_V = gate_.state()->battery_V;
    output().report(fmt::format("LIMO {}, battery {:.1f} V{}",
                                gate_.ready() ? "accepts commands" : "is connected", battery_V,
                                battery_V < kLowBatteryVolts ? " (low)" : ""));
  }

  NoContact no_contact() override {
    const std::scoped_lock lock(mutex_);
    return {.report = options_.port + ": waiting for LIMO: " + what_is_missing(),
            .gave_up = fail(
                ErrorCode::NotFound, "LIMO does not answer: " + what_is_missing(), {.source = options_.port},
                "Check that LIMO is on, that this is the port of its mainboard, and that the remote "
                "control is off.")};
  }

  [[nodiscard]] std::string what_is_missing() const {
    if (bytes_ == 0) return "no data received";
    if (frames_ == 0) return fmt::format("received {} bytes without a valid frame", bytes_);
    if (!gate_.state()) return fmt::format("received {} frames, but none with its state (0x211)", frames_);
    if (!gate_.state()->commanded) return "it is under remote control and ignores this port (0x211)";
    return fmt::format("received {} frames, but none with its motion (0x221)", frames_);
  }

  void report_gate() {
    std::vector<std::string> reports;
    {
      const std::scoped_lock lock(mutex_);
      reports = gate_.take_reports();
    }
    if (listens()) return;  // the reports are about commands
    for (const std::string& report : reports) output().report(report);
  }

  /// Reports on the silence of LIMO or only of its IMU.
  std::vector<std::string> silence_reports(Duration now) override {
    if (!greeted()) return {};
    const Duration silent = now - frame_at_;
    std::vector<std::string> reports = silence_.take_reports(silent);
    if (silent > kMaxFrameGap) return reports;
    const bool has_imu = bridge_.has_imu(SensorTime(now));
    if (had_imu_ && !has_imu)
      reports.emplace_back("no data from LIMO's IMU: the heading comes from the wheels");
    had_imu_ = has_imu;
    return reports;
  }

  std::string name_;
  LimoRobotOptions options_;
  Descriptor port_{};
  Descriptor beside_{};
  LimoReader reader_{};
  LineSplitter lines_{};
  LimoBridge bridge_;
  std::mutex mutex_{};
  CommandGate gate_;  ///< guarded by mutex_
  Duration asked_at_{};
  std::uint64_t bytes_ = 0;
  std::uint64_t frames_ = 0;
  std::uint64_t skipped_ = 0;
  Duration frame_at_{};  ///< arrival time of the newest frame
  SilenceReports silence_;
  bool had_imu_ = true;
};

}  // namespace

LimoDrive drive_of(const RobotDescription& robot) {
  return robot.simulation.dynamics.drive == "ackermann" ? LimoDrive::Ackermann : LimoDrive::Differential;
}

Status run_limo_robot(const RobotDescription& robot, const LimoRobotOptions& options, const RobotWire& wire) {
  LimoRobot process(robot, options, wire);
  if (Status opened = process.open(); !opened) return opened;
  return process.run();
}

}  // namespace waymark
