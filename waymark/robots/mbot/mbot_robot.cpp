#include "waymark/robots/mbot/mbot_robot.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/robots/mbot/lcm_link.hpp"
#include "waymark/robots/process/command_sender.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr Duration kSlice = std::chrono::milliseconds(50);
constexpr Duration kSilence = std::chrono::milliseconds(200);  // five messages of odometry
constexpr Duration kGone = std::chrono::seconds(2);
constexpr const char* kCommandChannel = "MBOT_VEL_CMD";
/// Of the messages of mbot_lcm_base: what is sensed, the robot's time, and who else drives; and ours.
constexpr const char* kChannels =
    "MBOT_ODOMETRY|MBOT_VEL|MBOT_IMU|MBOT_ENCODERS|MBOT_APRILTAG_ARRAY|LIDAR|MBOT_TIMESYNC|MBOT_VEL_CMD|TRUE_"
    "POSE|WAYMARK_SIMULATOR|WAYMARK_DRIVER";

/// The newest commands of ours, by their stamps: LCM gives a program its own messages, too.
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
  std::array<std::int64_t, 100> sent_{};  // of the last seconds
  std::size_t next_ = 0;
  std::int64_t newest_ = 0;
};

class MbotRobot {
 public:
  MbotRobot(const MbotRobotOptions& options, const RobotWire& wire)
      : options_(options), wire_(wire), bridge_(options.bridge), senders_(options.share_commands) {}

  Status run() {
    auto link = open_lcm(options_.address);
    if (!link) return tl::unexpected(link.error());
    if (Status status = (*link)->subscribe(kChannels); !status) return status;
    const auto send = [this, &link](const VelocityCommand& command) {
      // One that is not sent is repeated soon; the robot's own watchdog sees what is missing.
      (void)(*link)->publish(kCommandChannel, own_.make(silent() ? VelocityCommand{} : command));
    };
    EarlyInput early(wire_);
    std::optional<CommandSender> sender;
    began_ = steady_now();
    while (open_ && !(sender ? sender->ended() : early.said_bye()) && !wire_.should_stop()) {
      auto message = (*link)->next(kSlice);
      if (!message) return tl::unexpected(message.error());
      if (*message) receive(std::move(**message));
      listens_ = (sender ? sender->role() : early.role()) == InputRole::Listens;
      if (!greeted_ && senders_.done(steady_now())) {
        if (!listens_)
          if (Status alone = senders_.alone(kCommandChannel, driver_, "mbot robot"); !alone) return alone;
        greet();
        sender.emplace(send, wire_, early.role());
      }
      if (Status status = look(); !status) return status;
      if (sender && sender->role() == InputRole::Drives) presence_.publish(**link, kDriverChannel);
    }
    return {};
  }

 private:
  void write(const std::string& line) { open_ = open_ && wire_.write(line); }

  /// A robot that says nothing more is not driven, whatever is commanded.
  [[nodiscard]] bool silent() const { return steady_now() - newest_odometry_.load() > kSilence; }

  void receive(LcmMessage message) {
    heard_.insert(message.channel);
    if (message.channel == "MBOT_ODOMETRY") newest_odometry_ = message.arrived;
    if (message.channel == kSimulatorChannel || message.channel == kDriverChannel)
      return notice_presence(message);
    if (message.channel == kCommandChannel) return notice_driver(message);
    newest_lines_ = bridge_.receive(std::move(message));
    if (bridge_.speaks()) senders_.hear_robot(steady_now());
    if (greeted_) write_newest();
  }

  void write_newest() {
    for (const std::string& line : std::exchange(newest_lines_, {})) write(line);
    for (const std::string& line : bridge_.take_words()) write(line);
  }

  void greet() {
    greeted_ = true;
    write(to_line(RobotHello{.name = options_.bridge.robot, .simulated = simulated_}));
    for (const std::string& words : std::exchange(waiting_words_, {})) write(to_line(RobotLog{words}));
    write_newest();
  }

  void notice_presence(const LcmMessage& message) {
    if (message.channel == kSimulatorChannel)
      simulated_ = true;
    else
      driver_ = presence_of(message.payload);
  }

  void notice_driver(const LcmMessage& message) {
    if (!greeted_ && mbot::decode<mbot::Twist2D>(message.payload)) senders_.hear_command();
    const auto utime = mbot::utime_of(message.payload);
    if (listens_ || !utime || own_.has(*utime) || std::exchange(driven_, true)) return;
    say("another program sends MBOT_VEL_CMD as well: the robot obeys both in turn, end the other one");
  }

  /// Before the first odometry what is there, and how long it takes; later when it ceases.
  Status look() {
    if (greeted_) {
      say_of_silence();
      return {};
    }
    const Duration waited = steady_now() - began_;
    if (waited < options_.report_after) return {};
    const std::string found =
        heard_.empty() ? std::string("nothing was heard") : fmt::format("heard: {}", fmt::join(heard_, ", "));
    if (waited >= options_.give_up_after)
      return fail(
          ErrorCode::NotFound, fmt::format("no odometry came on MBOT_ODOMETRY; {}", found), {.source = "LCM"},
          "Is the robot on and its LCM server running, and does the address let messages out of it (ttl=1)?");
    if (!std::exchange(reported_, true)) wire_.say("no odometry on MBOT_ODOMETRY yet; " + found);
    return {};
  }

  void say_of_silence() {
    const Duration silent = steady_now() - newest_odometry_.load();
    if (silent <= kSilence) return void(quiet_ = gone_ = false);
    if (!std::exchange(quiet_, true))
      say(listens_ ? "no odometry for 0.2 s"
                   : "no odometry for 0.2 s: zero is sent until there is some again");
    if (silent > kGone && !std::exchange(gone_, true))
      say(fmt::format(
          "no odometry at {} for 2 s: is the robot on, do its programs run, is the network (cable, "
          "Wi-Fi) up on both sides?",
          options_.address.empty() ? "the usual address" : options_.address));
  }

  void say(const std::string& words) {
    if (greeted_)
      write(to_line(RobotLog{words}));
    else
      waiting_words_.push_back(words);
  }

  MbotRobotOptions options_;
  const RobotWire& wire_;
  MbotBridge bridge_;
  SenderWatch senders_;
  Presence presence_{};
  OwnCommands own_{};
  Duration began_{};
  std::atomic<Duration> newest_odometry_ = Duration(0);
  std::vector<std::string> newest_lines_{};  ///< of the message before the hello: what it told waited for it
  bool greeted_ = false;
  bool quiet_ = false;
  bool gone_ = false;
  bool open_ = true;
  bool driven_ = false;
  bool listens_ = false;  ///< somebody else drives
  bool simulated_ = false;
  std::string driver_{};  ///< another Waymark that commands the robot
  bool reported_ = false;
  std::set<std::string> heard_{};
  std::vector<std::string> waiting_words_{};
};

}  // namespace

Status run_mbot_robot(const MbotRobotOptions& options, const RobotWire& wire) {
  return MbotRobot(options, wire).run();
}

}  // namespace waymark
