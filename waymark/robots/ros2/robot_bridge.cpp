#include "waymark/robots/ros2/robot_bridge.hpp"

#include <utility>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/sample_decoder.hpp"
#include "waymark/robots/ros2/velocity_commands.hpp"

namespace waymark {
namespace {

constexpr std::string_view kTruthTopic = "/truth/pose";

/// The header with which most messages begin.
struct Headed {
  ros2::Header header{};
  WAYMARK_ROS2_FIELDS(self.header)
};

std::string frame_of(std::span<const std::uint8_t> bytes) {
  const auto message = cdr::decode<Headed>(bytes);
  return message ? frame_name(message->header.frame_id) : std::string();
}

}  // namespace

RobotBridge::RobotBridge(Ros2Profile profile, RobotDescription robot, PutImage put_image)
    : profile_(std::move(profile)),
      robot_(std::move(robot)),
      lines_("ROS 2", robot_.model.name, std::move(put_image)),
      base_frame_(frame_name(profile_.base_frame)) {}

std::vector<std::string> RobotBridge::receive(const Ros2Subscription& from,
                                              std::span<const std::uint8_t> bytes, Duration arrived) {
  const bool needs_clock = from.type != ros2::TFMessage::kType && from.type != ros2::CameraInfo::kType &&
                           from.type != ClockMessage::kType;
  if (profile_.use_sim_time) {
    if (needs_clock && !simulated_time_) return {};  // the delay of the message is unknown
    if (simulated_time_) arrived = simulated_time_->time_since_epoch();
  }
  if (needs_clock && !speaks() && from.topic != profile_.odometry_topic)
    return {};  // odometry defines the clock
  auto lines = lines_of(from, bytes, arrived);
  if (lines) return std::move(*lines);
  lines_.drop(from.topic, lines.error());
  return {};
}

Result<std::vector<std::string>> RobotBridge::lines_of(const Ros2Subscription& from,
                                                       std::span<const std::uint8_t> bytes,
                                                       Duration arrived) {
  std::vector<std::string> lines;
  if (from.type == ros2::TFMessage::kType || from.type == ros2::CameraInfo::kType ||
      from.type == ClockMessage::kType) {
    Status status = from.type == ClockMessage::kType      ? keep_clock(bytes)
                    : from.type == ros2::TFMessage::kType ? keep_transforms(bytes)
                                                          : compare_camera(bytes);
    if (!status) return tl::unexpected(status.error());
    return lines;
  }
  if (from.type == ros2::CompressedImage::kType) {
    auto line = compressed_image(from, bytes, arrived);
    if (!line) return tl::unexpected(line.error());
    lines.push_back(std::move(*line));
    return lines;
  }
  const auto add = [&](const Sample& sample) -> Status {
    Sample turned = sample;
    if (std::holds_alternative<CameraFrame>(sample)) camera_frame_ = frame_of(bytes);
    if (std::holds_alternative<Odometry>(sample)) learn_base(bytes);
    if (auto* imu = std::get_if<ImuSample>(&turned)) turn_imu(*imu, bytes);
    auto line = lines_.line_of(std::move(turned), from.topic, arrived, from.topic == profile_.odometry_topic);
    if (!line) return tl::unexpected(line.error());
    lines.push_back(std::move(*line));
    return {};
  };
  SampleDecoder decoder(add);
  const std::string_view topic =
      from.topic == profile_.truth_topic ? kTruthTopic : std::string_view(from.topic);
  Status status = decoder.add(topic, from.type, 0, bytes);
  if (status) status = decoder.finish();
  if (!status) return tl::unexpected(status.error());
  return lines;
}

/// Forwards the encoded image unchanged.
Result<std::string> RobotBridge::compressed_image(const Ros2Subscription& from,
                                                  std::span<const std::uint8_t> bytes, Duration arrived) {
  const auto message = cdr::decode<ros2::CompressedImage>(bytes);
  if (!message) return tl::unexpected(message.error());
  if (const auto header = probe(message->data, from.topic); !header) return tl::unexpected(header.error());
  const SensorTime stamp = ros2::from_ros(message->header.stamp);
  auto line = lines_.line_of(stamp, message->data, from.topic, arrived);
  if (line) camera_frame_ = frame_name(message->header.frame_id);
  return line;
}

/// Uses the base frame from the odometry unless the profile specifies one.
void RobotBridge::learn_base(std::span<const std::uint8_t> bytes) {
  if (!base_frame_.empty()) return;
  const auto message = cdr::decode<ros2::Odometry>(bytes);
  if (message) base_frame_ = frame_name(message->child_frame_id);
  if (base_frame_.empty()) base_frame_ = ros2::kBaseFrame;
}

void RobotBridge::turn_imu(ImuSample& imu, std::span<const std::uint8_t> bytes) {
  if (frames_.empty()) return;
  const std::string frame = frame_of(bytes);
  auto found = base_R_imu_.find(frame);
  if (found == base_R_imu_.end()) {
    const auto chain = frames_.chain(base_frame_, frame);
    if (!chain) {
      lines_.report_once(fmt::format("orientation of the IMU unknown; assumed aligned with the base: {}",
                                     chain.error().message));
      return;
    }
    found = base_R_imu_.emplace(frame, chain->rotation()).first;
  }
  imu.angular_velocity_rad_s = found->second * imu.angular_velocity_rad_s;
  imu.linear_acceleration_m_s2 = found->second * imu.linear_acceleration_m_s2;
}

/// Fails if the clock goes back, because the simulation was then restarted and earlier samples are unrelated
/// to it.
Status RobotBridge::keep_clock(std::span<const std::uint8_t> bytes) {
  const auto message = cdr::decode<ClockMessage>(bytes);
  if (!message) return tl::unexpected(message.error());
  const SensorTime now = ros2::from_ros(message->clock);
  if (simulated_time_ && now < *simulated_time_)
    return fail(
        ErrorCode::Unreadable,
        fmt::format(
            "the clock went back by {:.3f} s; if the simulation was restarted, restart this command, too",
            to_seconds(*simulated_time_ - now)));
  simulated_time_ = now;
  return {};
}

Status RobotBridge::keep_transforms(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kMaxFrames = 1000;
  const auto message = cdr::decode<ros2::TFMessage>(bytes);
  if (!message) return tl::unexpected(message.error());
  if (frames_.frames().size() + message->transforms.size() > kMaxFrames)
    return fail(ErrorCode::LimitExceeded, fmt::format("more than {} frames", kMaxFrames));
  for (const ros2::TransformStamped& link : message->transforms) {
    const auto finite = [](double x) { return std::abs(x) < 1e6; };
    const bool sound = finite(link.translation.x) && finite(link.translation.y) &&
                       finite(link.translation.z) && finite(link.rotation.x) && finite(link.rotation.y) &&
                       finite(link.rotation.z) && finite(link.rotation.w);
    frames_.add(link.header.frame_id, link.child_frame_id,
                sound ? std::optional<SE3>(ros2::from_ros(link)) : std::nullopt);
  }
  base_R_imu_.clear();
  compare_mounting();
  return {};
}

/// Compares the camera mounting in tf with that in the robot file.
void RobotBridge::compare_mounting() {
  constexpr double kMaxOffset_m = 0.02;
  constexpr double kMaxRotation_rad = 0.035;
  if (base_frame_.empty() || camera_frame_.empty() || !frames_.has(camera_frame_)) return;
  const auto base_T_cam = frames_.chain(base_frame_, camera_frame_);
  if (!base_T_cam) {
    lines_.report_once(fmt::format("no camera mounting in tf: {}", base_T_cam.error().message));
    return;
  }
  const SE3 off = robot_.model.base_T_cam.inverse() * *base_T_cam;
  const double turned = off.rotation().log().norm();
  if (off.translation().norm() > kMaxOffset_m || turned > kMaxRotation_rad)
    lines_.report_once(fmt::format(
        "camera mounting in tf differs by {:.0f} mm and {:.1f} degrees from robot file {}, which is used",
        1e3 * off.translation().norm(), to_degrees(turned), robot_.model.name));
}

/// Compares the published calibration with that in the robot file.
Status RobotBridge::compare_camera(std::span<const std::uint8_t> bytes) {
  const auto message = cdr::decode<ros2::CameraInfo>(bytes);
  if (!message) return tl::unexpected(message.error());
  const auto camera = ros2::from_ros(*message);
  if (!camera) return tl::unexpected(camera.error());
  if (camera_frame_.empty()) camera_frame_ = frame_name(message->header.frame_id);
  compare_mounting();
  if (std::string difference = camera_difference(*camera, robot_); !difference.empty())
    lines_.report_once(std::move(difference));
  return {};
}

std::vector<std::uint8_t> RobotBridge::command(const VelocityCommand& command, SensorTime now) const {
  return velocity_message({now, command}, profile_.command_stamped);
}

}  // namespace waymark
