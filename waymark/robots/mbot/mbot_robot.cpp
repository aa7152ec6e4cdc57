#include "waymark/robots/mbot/mbot_robot.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/robots/mbot/lcm_link.hpp"
#include "waymark/robots/process/command_sender.hpp"
#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/robots/wire/wire_loop.hpp"

namespace waymark {
namespace {

constexpr Duration kSlice = std::chrono::milliseconds(50);
constexpr Duration kSilence = std::chrono::milliseconds(200);  // the time for five odometry messages
constexpr Duration kGone = std::chrono::seconds(2);
constexpr const char* kCommandChannel = "MBOT_VEL_CMD";
constexpr const char* kOtherDriver =
    "another program also sends MBOT_VEL_CMD, and the robot obeys both in turn: stop the other program";
/// Messages from mbot_lcm_base (sensors, the robot's time, commands from other drivers), and Waymark's own
/// channels.
constexpr const char* kChannels =
    "MBOT_ODOMETRY|MBOT_VEL|MBOT_IMU|MBOT_ENCODERS|MBOT_APRILTAG_ARRAY|LIDAR|MBOT_TIMESYNC|MBOT_VEL_CMD|TRUE_"
    "POSE|WAYMARK_SIMULATOR|WAYMARK_DRIVER";

/// Recognises this program's own commands by their timestamps, because LCM also delivers messages to the
/// program that sent them.
class OwnCommands {
 public:
  Bytes make(const VelocityCommand& command) {
    const auto now = std::chrono::duration_cast<std::chrono::microseconds>(
        std::chrono::system_clock::now().time_since_epoch());
    const std::scoped_lock lock(mutex_);
    newest_ = std::max<std::int64_t>(now.count(), newest_ + 1);
    sent_.at(next_++ % sent_.size()) = newest_;
    return mbot::encode(mbot::Twist2D{.utime = newest_,
                                      .vx = static_cast<float>(command.speed_m_s),
                                      .wz = static_cast<float>(command.yaw_rate_rad_s)});
  }
  [[nodiscard]] bool has(std::int64_t utime) {
    const std::scoped_lock lock(mutex_);
    return std::ranges::find(sent_, utime) != sent_.end() && utime != 0;
  }

 private:
  std::mutex mutex_{};
  std::array<std::int64_t, 100> sent_{};  // stamps from the last few seconds
  std::size_t next_ = 0;
  std::int64_t newest_ = 0;
};

std::vector<SilenceReports::Report> reports_of_silence(const std::string& address) {
  return {{.after = kSilence,
           .text = "no odometry for 0.2 s: sending zero until it is back",
           .text_listening = "no odometry for 0.2 s"},
          {.after = kGone,
           .text = fmt::format(
               "no odometry at {} for 2 s: check that the robot is on, that its programs run, and that the "
               "network (cable, Wi-Fi) is up on both sides",
               address.empty() ? "the default address" : address)}};
}

class MbotRobot final : public WireLoop {
 public:
  MbotRobot(const MbotRobotOptions& options, const RobotWire& wire)
      : WireLoop(wire),
        options_(options),
        bridge_(options.bridge),
        senders_(options.share_commands),
        silence_(kSilence, reports_of_silence(options.address)) {}

  /// Joins the network; to be called before run().
  Status join() {
    auto link = open_lcm(options_.address);
    if (!link) return tl::unexpected(link.error());
    link_ = std::move(*link);
    return link_->subscribe(kChannels);
  }

 private:
  Status poll_robot() override {
    auto message = link_->next(kSlice);
    if (!message) return tl::unexpected(message.error());
    if (*message) receive(std::move(**message));
    return {};
  }
  Result<bool> ready() override { return senders_.done(steady_now()); }
  Status prepare() override {
    return listens() ? Status{} : senders_.check_alone(kCommandChannel, driver_, "mbot robot");
  }
  RobotHello hello() const override { return {.name = options_.bridge.robot, .simulated = simulated_}; }
  void after_hello() override {
    if (driven_) output().report(kOtherDriver);
    write_newest();
  }
  /// Ignores errors, because commands are soon repeated and the robot has its own watchdog.
  void send(const VelocityCommand& command) override {
    (void)link_->publish(kCommandChannel, own_.make(silence() > kSilence ? VelocityCommand{} : command));
  }
  std::vector<std::string> silence_reports(Duration /*now*/) override {
    return greeted() ? silence_.take_reports(silence(), listens()) : std::vector<std::string>();
  }
  Status check() override {
    if (greeted() && role() == InputRole::Drives) presence_.publish(*link_, kDriverChannel);
    return {};
  }
  NoContact no_contact() override {
    const std::string found = channels_.empty()
                                  ? std::string("no messages received")
                                  : fmt::format("received messages on {}", fmt::join(channels_, ", "));
    return {.report = "no odometry on MBOT_ODOMETRY yet; " + found,
            .gave_up = fail(ErrorCode::NotFound, fmt::format("no odometry on MBOT_ODOMETRY; {}", found),
                            {.source = "LCM"},
                            "Check that the robot is on, that its LCM server runs, and that its address has "
                            "ttl=1, so that messages leave its computer.")};
  }

  /// Time since the newest odometry; if the robot is silent, zero is sent. May be called from any thread.
  [[nodiscard]] Duration silence() const { return steady_now() - newest_odometry_.load(); }

  void receive(LcmMessage message) {
    channels_.insert(message.channel);
    if (message.channel == "MBOT_ODOMETRY") newest_odometry_ = message.arrived;
    if (message.channel == kSimulatorChannel || message.channel == kDriverChannel)
      return notice_presence(message);
    if (message.channel == kCommandChannel) return notice_driver(message);
    newest_lines_ = bridge_.receive(std::move(message));
    if (bridge_.speaks()) senders_.on_robot_message(steady_now());
    if (greeted()) write_newest();
  }

  void write_newest() {
    output().write(std::exchange(newest_lines_, {}));
    output().write(bridge_.take_reports());
  }

  void notice_presence(const LcmMessage& message) {
    if (message.channel == kSimulatorChannel)
      simulated_ = true;
    else
      driver_ = presence_of(message.payload);
  }

  void notice_driver(const LcmMessage& message) {
    if (!greeted() && mbot::decode<mbot::Twist2D>(message.payload)) senders_.on_other_command();
    const auto utime = mbot::utime_of(message.payload);
    if (listens() || !utime || own_.has(*utime) || std::exchange(driven_, true)) return;
    if (greeted()) output().report(kOtherDriver);  // otherwise after_hello() reports it
  }

  MbotRobotOptions options_;
  MbotBridge bridge_;
  SenderWatch senders_;
  SilenceReports silence_;
  std::unique_ptr<LcmLink> link_{};
  Presence presence_{};
  OwnCommands own_{};
  std::atomic<Duration> newest_odometry_ = Duration(0);
  std::vector<std::string> newest_lines_{};  ///< lines of the newest message, also before the hello
  bool driven_ = false;                      ///< whether another program also sends commands
  bool simulated_ = false;
  std::string driver_{};              ///< name of another Waymark program that commands the robot
  std::set<std::string> channels_{};  ///< channels on which messages have been received
};

}  // namespace

Status run_mbot_robot(const MbotRobotOptions& options, const RobotWire& wire) {
  MbotRobot process(options, wire);
  if (Status joined = process.join(); !joined) return joined;
  return process.run();
}

}  // namespace waymark
