#include "waymark/robots/mbot/mbot_bridge.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

constexpr Duration kListen = std::chrono::seconds(1);
constexpr std::uint64_t kMinTags = 10;
constexpr std::uint64_t kMinImus = 10;
constexpr std::size_t kMaxHeldMessages = 400;
constexpr const char* kTruthChannel = "TRUE_POSE";  // published by a simulator
constexpr std::int64_t kMaxStamp_us = std::int64_t{1} << 52U;
constexpr double kMaxClockOffset_s = 0.1;

/// The stream name of a sample, for reports.
std::string stream_of(const Sample& sample) {
  if (std::holds_alternative<Odometry>(sample)) return "odometry";
  if (std::holds_alternative<ImuSample>(sample)) return "the IMU";
  if (std::holds_alternative<TagPoseFrame>(sample)) return "the tags";
  if (std::holds_alternative<WheelTicks>(sample)) return "the encoders";
  if (std::holds_alternative<LaserScan>(sample)) return "the lidar";
  return "the ground truth";
}

bool is_odometry(const LcmMessage& message) {
  return mbot::fingerprint_of(message.payload) == mbot::kPose2D &&
         message.channel.find("ODOM") != std::string::npos;
}

}  // namespace

MbotBridge::MbotBridge(const MbotBridgeOptions& options)
    : options_(options),
      visitor_([this](const Sample& sample) -> Status {
        early_.push_back({sample, arrived_});
        return {};
      }),
      samples_(conventions_, options.tag_latency, problems_, visitor_) {
  (void)check_.read({.text = to_line(RobotHello{.name = options_.robot})});
}

std::vector<std::string> MbotBridge::take_reports() {
  std::vector<std::string> lines;
  for (std::string& text : std::exchange(pending_, {})) lines.push_back(to_line(RobotLog{std::move(text)}));
  return lines;
}

void MbotBridge::drop(const std::string& channel, const std::string& why) {
  ++dropped_;
  std::string report = drops_.add(channel, why);
  if (!report.empty()) pending_.push_back(std::move(report));
}

void MbotBridge::survey(const LcmMessage& message) {
  survey_.add(message.payload);
  const bool imu = !imu_determined_ && survey_.imus() >= kMinImus;
  const bool tags = !tags_determined_ && survey_.tags() >= kMinTags;
  if (!imu && !tags) return;
  imu_determined_ = imu_determined_ || imu;
  tags_determined_ = tags_determined_ || tags;
  const mbot::Conventions now = survey_.conventions();
  if (imu) conventions_.accelerometer_shows_gravity = now.accelerometer_shows_gravity;
  if (tags) {
    const bool gravity = conventions_.accelerometer_shows_gravity;
    conventions_ = now;
    conventions_.accelerometer_shows_gravity = gravity;
  }
  samples_.use(conventions_);
}

bool MbotBridge::is_determined(const LcmMessage& message) const {
  const std::uint64_t type = mbot::fingerprint_of(message.payload);
  if (type == mbot::kImu) return imu_determined_;
  if (type != mbot::kTagArray || tags_determined_) return true;
  const auto array = mbot::decode<mbot::TagArray>(message.payload);
  return !array || array->tags.empty();
}

void MbotBridge::hold(LcmMessage message) {
  if (held_.size() >= kMaxHeldMessages) {
    drop(held_.front().channel, "its conventions could not be determined in time");
    held_.pop_front();
  }
  held_.push_back(std::move(message));
}

void MbotBridge::release() {
  std::deque<LcmMessage> waiting = std::exchange(held_, {});
  for (LcmMessage& message : waiting) {
    if (is_determined(message))
      take(message);
    else
      held_.push_back(std::move(message));
  }
}

std::vector<std::string> MbotBridge::receive(LcmMessage message) {
  const std::uint64_t type = mbot::fingerprint_of(message.payload);
  if (mbot::type_name(type).empty()) {
    drop(message.channel, fmt::format("its fingerprint {:016x} is not of an MBot message", type));
    return {};
  }
  if (type == mbot::kTimestamp) compare_clock(message);
  if (!first_) first_ = message.arrived;
  if (is_odometry(message)) {
    const std::int64_t utime = mbot::utime_of(message.payload).value_or(0);
    const std::int64_t stamp = utime > 0 && utime < kMaxStamp_us ? utime : message.received_us;
    clock_.receive(SensorTime(std::chrono::microseconds(stamp)), message.arrived);
  }
  survey(message);
  const bool determined = imu_determined_ && tags_determined_;
  const bool waited = message.arrived - *first_ > kListen;
  const bool passes = !listening_ && is_determined(message) && held_.empty();
  if (passes) {
    take(message);
  } else {
    hold(std::move(message));
    listening_ = listening_ && !determined && !waited;
    if (!listening_) release();
  }
  note_problems();
  return std::exchange(lines_, {});
}

void MbotBridge::take(const LcmMessage& message) {
  arrived_ = message.arrived;
  const auto robot_now = clock_.at(message.arrived);
  const std::int64_t received_us =
      robot_now ? std::chrono::duration_cast<std::chrono::microseconds>(robot_now->time_since_epoch()).count()
                : message.received_us;
  if (message.channel == kTruthChannel)
    take_truth(message);
  else
    (void)samples_.add(message.channel, received_us, message.payload);
  if (!speaks()) {
    const auto first = std::ranges::find_if(
        early_, [](const Stamped& one) { return std::holds_alternative<Odometry>(one.sample); });
    if (first == early_.end() && early_.size() >= kMaxHeldMessages) early_.erase(early_.begin());
    if (first == early_.end()) return;
    (void)gate_.pass("odometry", stamp_of(first->sample), first->arrived, true);
  }
  for (const Stamped& stamped : std::exchange(early_, {})) write(stamped);
}

void MbotBridge::take_truth(const LcmMessage& message) {
  const auto pose = mbot::decode<mbot::Pose2D>(message.payload);
  if (!pose || pose->utime <= 0) return drop(message.channel, "it is not a stamped pose");
  const SE2 map_T_base(double{pose->x}, double{pose->y}, double{pose->theta});
  early_.push_back(
      {TruthPose{SensorTime(std::chrono::microseconds(pose->utime % kMaxStamp_us)), lift(map_T_base)},
       message.arrived});
}

void MbotBridge::write(const Stamped& stamped) {
  if (std::holds_alternative<StampedCommand>(stamped.sample)) return;  // sent by a driver, not measured
  const std::string stream = stream_of(stamped.sample);
  const bool leads = std::holds_alternative<Odometry>(stamped.sample);
  if (Status status = gate_.pass(stream, stamp_of(stamped.sample), stamped.arrived, leads); !status)
    return drop(stream, status.error().message);
  std::string line = to_line(stamped.sample);
  const auto checked = check_.read({.number = ++checked_, .text = line});
  if (!checked) return drop(stream, checked.error().message);
  lines_.push_back(std::move(line));
}

/// Compares the clocks; the robot's computer sends its time once a second.
void MbotBridge::compare_clock(const LcmMessage& message) {
  const auto theirs = mbot::decode<mbot::Timestamp>(message.payload);
  if (!theirs) return drop(message.channel, "its length does not match its type");
  const double behind_s =
      1e-6 * (static_cast<double>(message.received_us) - static_cast<double>(theirs->utime));
  if (std::abs(behind_s) < kMaxClockOffset_s || !compared_.insert(message.channel).second) return;
  pending_.push_back(fmt::format(
      "the clock of the robot's computer is {:.1f} s {} this computer's ({}); stamps use the robot's clock",
      std::abs(behind_s), behind_s > 0 ? "behind" : "ahead of", message.channel));
}

/// Reports each decoding problem once, and damaged messages again each time their number has doubled.
void MbotBridge::note_problems() {
  for (const LogProblem& problem : problems_.list()) {
    std::uint64_t& reported = reported_[problem.key];
    const bool damage = problem.kind == LogProblem::Kind::Damage;
    if (reported != 0 && (!damage || problem.count < 2 * reported)) continue;
    if (damage) dropped_ += problem.count - reported;
    reported = problem.count;
    pending_.push_back(damage && problem.count > 1
                           ? fmt::format("{} times: {}", problem.count, to_string(problem.error))
                           : to_string(problem.error));
  }
}

}  // namespace waymark
