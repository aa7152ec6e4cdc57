#include "waymark/app/convert/play_log.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/message_text.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {

// Printing samples as lines.
namespace {

struct Kind {
  const char* operator()(const TagFrame& /**/) const { return "tags"; }
  const char* operator()(const Odometry& /**/) const { return "odometry"; }
  const char* operator()(const WheelTicks& /**/) const { return "wheels"; }
  const char* operator()(const ImuSample& /**/) const { return "imu"; }
  const char* operator()(const StampedCommand& /**/) const { return "commands"; }
  const char* operator()(const TruthPose& /**/) const { return "truth"; }
  const char* operator()(const CameraFrame& /**/) const { return "images"; }
  const char* operator()(const TagPoseFrame& /**/) const { return "tag_poses"; }
  const char* operator()(const RangeBearing& /**/) const { return "range_bearing"; }
  const char* operator()(const LaserScan& /**/) const { return "scans"; }
  const char* operator()(const GamepadState& /**/) const { return "gamepad"; }
};

std::string planar(const SE2& a_T_b) {
  return fmt::format("x {:.3f} m, y {:.3f} m, yaw {:.2f} deg", a_T_b.translation().x(),
                     a_T_b.translation().y(), a_T_b.rotation().angle() * 180 / M_PI);
}

std::size_t echoes(const LaserScan& scan) {
  std::size_t n = 0;
  for (const float range : scan.ranges_m)
    n += range >= scan.range_min_m && range <= scan.range_max_m ? 1U : 0U;
  return n;
}

struct SampleText {
  std::string operator()(const TagFrame& s) const {
    std::vector<std::string> tags;
    for (const TagDetection& d : s.detections) tags.push_back(to_string(d.tag));
    return tags.empty() ? "none" : fmt::format("{}", fmt::join(tags, " "));
  }
  std::string operator()(const Odometry& s) const {
    return fmt::format("{}, {:.3f} m/s, {:.3f} rad/s", planar(s.odom_T_base), s.speed_m_s, s.yaw_rate_rad_s);
  }
  std::string operator()(const WheelTicks& s) const {
    return fmt::format("left {:.3f} rad, right {:.3f} rad", s.left_rad, s.right_rad);
  }
  std::string operator()(const ImuSample& s) const {
    const auto& w = s.angular_velocity_rad_s;
    const auto& a = s.linear_acceleration_m_s2;
    return fmt::format("{:.4f} {:.4f} {:.4f} rad/s, {:.3f} {:.3f} {:.3f} m/s^2", w.x(), w.y(), w.z(), a.x(),
                       a.y(), a.z());
  }
  std::string operator()(const StampedCommand& s) const {
    return fmt::format("{:.3f} m/s, {:.3f} rad/s", s.command.speed_m_s, s.command.yaw_rate_rad_s);
  }
  std::string operator()(const TruthPose& s) const { return planar(project_to_plane(s.map_T_base)); }
  std::string operator()(const CameraFrame& s) const {
    return fmt::format("{}: {} x {} px", s.camera, s.image.width(), s.image.height());
  }
  std::string operator()(const TagPoseFrame& s) const {
    std::vector<std::string> tags;
    for (const SeenTagPose& t : s.tags)
      tags.push_back(fmt::format("{} at {:.3f} m", to_string(t.tag), t.cam_T_tag.translation().norm()));
    return tags.empty() ? "none" : fmt::format("{}", fmt::join(tags, ", "));
  }
  std::string operator()(const RangeBearing& s) const {
    return fmt::format("landmark {}: {:.3f} m, {:.2f} deg", s.landmark, s.range_m,
                       s.bearing_rad * 180 / M_PI);
  }
  std::string operator()(const LaserScan& s) const {
    return fmt::format("{} rays, {} echoes", s.ranges_m.size(), echoes(s));
  }
  std::string operator()(const GamepadState& s) const {
    return fmt::format("axes {:.2f}, buttons {}", fmt::join(s.axes, " "), fmt::join(s.buttons, " "));
  }
};

std::array<double, 3> list_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

struct PlayedPose {
  SE3 a_T_b{};
};

ReportFields fields(const PlayedPose& pose) {
  const Eigen::Quaterniond q = pose.a_T_b.rotation().quaternion();
  return {{"translation_m", "x, y, z", list_of(pose.a_T_b.translation())},
          {"quaternion_xyzw", "Rotation", std::array{q.x(), q.y(), q.z(), q.w()}}};
}

struct PlayedPlanarPose {
  SE2 a_T_b{};
};

ReportFields fields(const PlayedPlanarPose& pose) {
  const Eigen::Vector2d& at = pose.a_T_b.translation();
  return {{"x_m", "Position", at.x()},
          {"y_m", "Position", at.y()},
          {"yaw_rad", "Heading", pose.a_T_b.rotation().angle()}};
}

struct PlayedTag {
  TagId tag{};
  std::array<std::array<double, 2>, 4> corners_px{};
};

ReportFields fields(const PlayedTag& tag) {
  return {{"tag", "Family and id, such as tag36h11:7", to_string(tag.tag)},
          {"corners_px",
           "[x, y] of the top left, top right, bottom right and bottom left corner of the printed tag",
           tag.corners_px}};
}

struct PlayedTagPose {
  SeenTagPose seen{};
};

ReportFields fields(const PlayedTagPose& tag) {
  return {{"tag", "Family and id, such as tag36h11:7", to_string(tag.seen.tag)},
          {"cam_T_tag", "Pose of the tag in the camera", PlayedPose{tag.seen.cam_T_tag}}};
}

/// Fields of samples. A key used for several kinds has the same description in all of them.
struct SampleFields {
  static ReportField camera_field(const std::string& camera) {
    return {"camera", "tags, tag_poses, images: name of the camera", camera};
  }
  static ReportFields speeds(double speed_m_s, double yaw_rate_rad_s) {
    return {{"speed_m_s", "odometry, commands: forward speed", speed_m_s},
            {"yaw_rate_rad_s", "odometry, commands: yaw rate, counter-clockwise", yaw_rate_rad_s}};
  }

  ReportFields operator()(const TagFrame& s) const {
    std::vector<PlayedTag> tags;
    for (const TagDetection& d : s.detections) {
      PlayedTag tag{.tag = d.tag};
      for (std::size_t i = 0; i < d.corners_px.size(); ++i)
        tag.corners_px[i] = {d.corners_px[i].x(), d.corners_px[i].y()};
      tags.push_back(tag);
    }
    return {camera_field(s.camera), {"detections", "tags: detected tags", tags}};
  }
  ReportFields operator()(const Odometry& s) const {
    ReportFields all = {{"odom_T_base", "odometry: pose of the robot in the odometry frame",
                         PlayedPlanarPose{s.odom_T_base}}};
    for (ReportField& field : speeds(s.speed_m_s, s.yaw_rate_rad_s)) all.push_back(std::move(field));
    return all;
  }
  ReportFields operator()(const WheelTicks& s) const {
    return {{"left_rad", "wheels: angle of the left wheels since the robot was switched on", s.left_rad},
            {"right_rad", "wheels: angle of the right wheels since the robot was switched on", s.right_rad}};
  }
  ReportFields operator()(const ImuSample& s) const {
    return {{"angular_velocity_rad_s", "imu: angular velocity about x, y, z of the base",
             list_of(s.angular_velocity_rad_s)},
            {"linear_acceleration_m_s2", "imu: specific force along x, y, z of the base",
             list_of(s.linear_acceleration_m_s2)}};
  }
  ReportFields operator()(const StampedCommand& s) const {
    return speeds(s.command.speed_m_s, s.command.yaw_rate_rad_s);
  }
  ReportFields operator()(const TruthPose& s) const {
    return {{"map_T_base", "truth: true pose of the robot", PlayedPose{s.map_T_base}}};
  }
  ReportFields operator()(const CameraFrame& s) const {
    return {camera_field(s.camera),
            {"width_px", "images: width", s.image.width()},
            {"height_px", "images: height", s.image.height()}};
  }
  ReportFields operator()(const TagPoseFrame& s) const {
    const std::vector<PlayedTagPose> tags(s.tags.begin(), s.tags.end());
    return {camera_field(s.camera), {"tags", "tag_poses: tags with their poses", tags}};
  }
  ReportFields operator()(const RangeBearing& s) const {
    return {{"landmark", "range_bearing: number of the landmark", s.landmark},
            {"range_m", "range_bearing: distance", s.range_m},
            {"bearing_rad", "range_bearing: direction, counter-clockwise from the x axis of the sensor",
             s.bearing_rad}};
  }
  ReportFields operator()(const LaserScan& s) const {
    return {{"angle_min_rad", "scans: direction of the first ray", s.angle_min_rad},
            {"angle_increment_rad", "scans: angle between consecutive rays", s.angle_increment_rad},
            {"ranges_m", "scans: distances; null if not finite", s.ranges_m}};
  }
  ReportFields operator()(const GamepadState& s) const {
    return {{"axes", "gamepad: sticks, -1 to 1", s.axes}, {"buttons", "gamepad: 1 if pressed", s.buttons}};
  }
};

}  // namespace

const char* kind_of(const Sample& sample) { return std::visit(Kind{}, sample); }

std::string to_text(const Sample& sample, SensorTime start) {
  return fmt::format("{:>10.3f}  {:<13}  {}\n", to_seconds(stamp_of(sample) - start), kind_of(sample),
                     std::visit(SampleText{}, sample));
}

ReportFields fields(const Sample& sample) {
  ReportFields all = {
      {"kind",
       "tags, images, odometry, wheels, imu, commands, truth, tag_poses, range_bearing, scans or gamepad",
       kind_of(sample)},
      {"stamp_ns", "Time of the sample on the sensor clock", stamp_of(sample).time_since_epoch().count()}};
  for (ReportField& field : std::visit(SampleFields{}, sample)) all.push_back(std::move(field));
  return all;
}

ReportFields fields(const PlayedMessage& message) {
  return {{"topic", "`messages`: name of the topic", message.topic},
          {"type", "`messages`: type of the message", message.type},
          {"log_time_ns", "`messages`: time of recording", message.log_time_ns},
          {"publish_time_ns", "`messages`: time of publication", message.publish_time_ns},
          {"size_bytes", "`messages`: size of the message", message.size_bytes}};
}

// Playback.
namespace {

/// Waits until the time of a recorded message is due.
class PlaybackPace {
 public:
  PlaybackPace(double speed, const std::function<bool()>& cancelled) : speed_(speed), cancelled_(cancelled) {}

  /// Returns false if cancelled.
  bool wait_for(std::int64_t time_ns) {
    using std::chrono::steady_clock;
    if (!first_ns_) first_ns_ = time_ns;
    if (speed_ <= 0) return !cancelled_();
    const double since_s =
        static_cast<double>(std::max<std::int64_t>(0, time_ns - *first_ns_)) * 1e-9 / speed_;
    const auto due = begin_ + std::chrono::duration_cast<steady_clock::duration>(
                                  std::chrono::duration<double>(std::min(since_s, kMaxWait_s)));
    // Sleep in slices, so that cancellation takes effect quickly.
    while (!cancelled_() && steady_clock::now() < due)
      std::this_thread::sleep_for(std::min<steady_clock::duration>(due - steady_clock::now(), kSlice));
    return !cancelled_();
  }

 private:
  static constexpr double kMaxWait_s = 1e8;
  static constexpr std::chrono::milliseconds kSlice{50};

  double speed_;
  const std::function<bool()>& cancelled_;
  std::optional<std::int64_t> first_ns_{};
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// The error returned by a visitor to stop reading a log.
tl::unexpected<Error> stop_visit() { return fail(ErrorCode::LimitExceeded, "stopped"); }

std::string message_line(const LogChannel& channel, const LogMessage& message, std::uint64_t start,
                         bool json) {
  if (json)
    return json_line(fields(PlayedMessage{.topic = channel.topic,
                                          .type = channel.type,
                                          .log_time_ns = message.log_time,
                                          .publish_time_ns = message.publish_time,
                                          .size_bytes = message.data.size()}));
  const double since_s = static_cast<double>(static_cast<std::int64_t>(message.log_time - start)) * 1e-9;
  return fmt::format("{:>10.3f}  {:<24}  {}, {} bytes\n", since_s, channel.topic, channel.type,
                     message.data.size());
}

}  // namespace

Status play_messages(MessageLog& log, const LogSelection& selection, double speed,
                     const MessageLog::Visitor& on_message, const std::function<bool()>& cancelled) {
  PlaybackPace pace(speed, cancelled);
  const std::uint64_t start = recording_start_ns(log);
  return log.visit(selection, [&](const LogChannel& channel, const LogMessage& message) -> Status {
    if (!pace.wait_for(static_cast<std::int64_t>(std::max(start, message.log_time)))) return stop_visit();
    return on_message(channel, message);
  });
}

Result<LogSelection> select_part(MessageLog& log, const LogPart& part) {
  LogSelection selection;
  std::vector<std::string> known;
  for (const LogChannel& channel : log.channels()) known.push_back(channel.topic);
  for (const std::string& topic : part.topics) {
    if (std::ranges::find(known, topic) == known.end())
      return fail(ErrorCode::NotFound, fmt::format("the recording has no topic '{}'", topic),
                  {.key = "topics"}, suggestion(topic, known));
    selection.topics.insert(topic);
  }
  if (!(part.from_s >= 0 && part.to_s > part.from_s))
    return fail(ErrorCode::InvalidArgument,
                fmt::format("invalid interval from {} s to {} s", part.from_s, part.to_s), {.key = "from"},
                "Give seconds after the first message, for example `from=10` `to=20`.");
  const std::uint64_t start = recording_start_ns(log);
  if (const LogSummary& all = log.summary(); all.complete && all.end) {
    const double duration_s = static_cast<double>(static_cast<std::int64_t>(*all.end - start)) * 1e-9;
    if (part.from_s > std::max(0.0, duration_s))
      return fail(
          ErrorCode::InvalidArgument,
          fmt::format("the recording ends before this time, {:.3f} s after its first message", duration_s),
          {.key = "from"}, "Use a smaller value.");
  }
  constexpr double kMax_s = 1e9;  // about 30 years
  if (part.from_s > 0)
    selection.from = start + static_cast<std::uint64_t>(std::min(part.from_s, kMax_s) * 1e9);
  if (part.to_s < kMax_s) selection.to = start + static_cast<std::uint64_t>(part.to_s * 1e9);
  return selection;
}

Status play_log(MessageLog& log, const LogSelection& selection, const PlayOptions& options,
                const std::function<bool(const std::string&)>& on_line,
                const std::function<bool()>& cancelled) {
  if (options.messages) {
    const auto on_message = [&, start = recording_start_ns(log)](const LogChannel& channel,
                                                                 const LogMessage& message) -> Status {
      return on_line(message_line(channel, message, start, options.json)) ? Status() : stop_visit();
    };
    return play_messages(log, selection, options.speed, on_message, cancelled);
  }
  PlaybackPace pace(options.speed, cancelled);
  std::optional<SensorTime> start;
  return log.visit_samples(selection, [&](const Sample& sample) -> Status {
    if (!start) start = stamp_of(sample);
    if (!pace.wait_for(stamp_of(sample).time_since_epoch().count())) return stop_visit();
    return on_line(options.json ? json_line(fields(sample)) : to_text(sample, *start)) ? Status()
                                                                                       : stop_visit();
  });
}

Status check_effects(const PlayRequest& request, const GivenFields& given) {
  if (!(request.options.speed >= 0 && request.options.speed <= 1e6))
    return fail(ErrorCode::InvalidArgument, fmt::format("invalid playback rate {}", request.options.speed),
                {.key = "speed"}, "Use 1 for the recorded rate, or 0 for playback without waiting.");
  FieldRefusals refused(given);
  refused.fields(request.ros2, {"messages", "json"}, "nothing is printed with `ros2`", "Omit this option.");
  refused.fields(!request.ros2, {"commands"}, "nothing is published without `ros2`",
                 "Add `ros2`, or omit this option.");
  return refused.status();
}

}  // namespace waymark
